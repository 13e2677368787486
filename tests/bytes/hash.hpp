// Fingerprints of bytes: FNV-1a, 64 bits. It need not withstand an attack, only tell a changed byte.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace bytes {

class Hash {
 public:
  Hash& add(std::string_view text) {
    for (const char character : text) {
      state_ = (state_ ^ static_cast<unsigned char>(character)) * 0x100000001b3ULL;
    }
    return *this;
  }

  /// The bytes of a number as they stand in memory: -0 differs from 0, and one NaN from another.
  template <typename T>
  requires std::is_arithmetic_v<T> Hash& add(T value) {
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    return add(std::string_view(raw, sizeof value));
  }

  /// Shape and elements, column by column.
  template <typename Derived>
  Hash& add(const Eigen::DenseBase<Derived>& matrix) {
    add(matrix.rows()).add(matrix.cols());
    for (Eigen::Index column = 0; column < matrix.cols(); ++column) {
      for (Eigen::Index row = 0; row < matrix.rows(); ++row) add(matrix(row, column));
    }
    return *this;
  }

  /// 16 hexadecimal digits.
  std::string text() const {
    std::string digits(16, '0');
    for (int k = 0; k < 16; ++k) digits[15 - k] = "0123456789abcdef"[(state_ >> (4 * k)) & 15];
    return digits;
  }

 private:
  std::uint64_t state_ = 0xcbf29ce484222325ULL;
};

inline std::string hash_of(std::string_view text) { return Hash().add(text).text(); }

}  // namespace bytes
