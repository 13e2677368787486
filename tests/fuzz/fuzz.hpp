// What the fuzz targets share. A target is a function of bytes, which libFuzzer or replay.cpp calls with one input
// after another. libFuzzer has a program for each target; replay.cpp has all in one, which takes a tenth of the time to
// compile.
#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace fuzz {

using Target = int (*)(const std::uint8_t* data, std::size_t size);

/// By name, for replay.cpp.
inline std::map<std::string, Target>& targets() {
  static std::map<std::string, Target> all;
  return all;
}

/// Ends the program if a claim does not hold, so that the input is kept.
inline void require(bool holds, const std::string& claim) {
  if (holds) return;
  fmt::print(stderr, "the claim does not hold: {}\n", claim);
  std::abort();
}

inline std::string text_of(const std::uint8_t* data, std::size_t size) { return {data, data + size}; }

/// Decisions and numbers drawn from the bytes of an input. When they are used up, all further bytes are 0.
class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), end_(data + size) {}

  bool empty() const { return data_ == end_; }

  int byte() { return empty() ? 0 : *data_++; }

  bool coin() { return byte() % 2 == 1; }

  /// 0 ... bound - 1, bound at most 65536.
  int below(int bound) { return bound <= 256 ? byte() % bound : (byte() * 256 + byte()) % bound; }

  template <class Value>
  const Value& one_of(const std::vector<Value>& values) {
    return values[below(static_cast<int>(values.size()))];
  }

  /// A number of ordinary size, on a grid, so that equal numbers are frequent.
  double ordinary() { return static_cast<double>(below(65536) - 32768) / 256.0; }

  /// A finite number: mostly ordinary, else one that computers find difficult.
  double number() {
    static const std::vector<double> difficult = {
        0.0,    -0.0,  1.0,    -1.0,  0.5,   1e-9,  1e9,          -1e12,
        1e15,   1e100, -1e100, 1e150, 1e200, 1e308, -1e308,       1e-300,
        5e-324, 2.0,   -1e-30, 1e30,  3.0,   1e-12, 4294967296.0, std::numeric_limits<double>::epsilon()};
    return byte() % 4 == 0 ? one_of(difficult) : ordinary();
  }

 private:
  const std::uint8_t* data_;
  const std::uint8_t* end_;
};

}  // namespace fuzz

/// Begins the function of the target `name`, once in a namespace of its own.
#ifdef LLMT_FUZZ
#define FUZZ_TARGET(name) extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
#else
#define FUZZ_TARGET(name)                                                                \
  static int run(const std::uint8_t* data, std::size_t size);                            \
  [[maybe_unused]] static const bool added = fuzz::targets().emplace(#name, run).second; \
  static int run(const std::uint8_t* data, std::size_t size)
#endif
