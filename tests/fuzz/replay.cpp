// Runs a fuzz target without libFuzzer: first on the seeds, then on pseudo-random changes of them, the same ones in
// every run.
//
//   fuzz_replay TARGET SEED_FOLDER COUNT [KEEP]    COUNT changes; each input is written to the file KEEP before it is
//   run fuzz_replay TARGET FILE                        that input alone
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "fuzz/fuzz.hpp"
#include "llmt/random.hpp"

namespace {

using Input = std::vector<std::uint8_t>;

Input read(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

std::vector<Input> seeds_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  if (std::filesystem::is_directory(folder)) {
    for (const auto& entry : std::filesystem::directory_iterator(folder)) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  std::vector<Input> seeds;
  std::ranges::transform(files, std::back_inserter(seeds), read);
  return seeds;
}

class Mutator {
 public:
  explicit Mutator(std::vector<Input> seeds) : seeds_(std::move(seeds)) {}

  Input next() {
    // What has no seeds draws its decisions from any bytes.
    if (seeds_.empty()) return noise(below(400));
    Input input = seeds_[below(seeds_.size())];
    const std::size_t changes = 1 + below(6);
    for (std::size_t k = 0; k < changes; ++k) change(input);
    return input;
  }

 private:
  std::vector<Input> seeds_;
  llmt::Random random_{1};

  std::size_t below(std::size_t bound) { return random_.below(std::max<std::size_t>(bound, 1)); }

  Input noise(std::size_t size) {
    Input bytes(size);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(below(256));
    return bytes;
  }

  void change(Input& input) {
    const std::size_t at = below(input.size() + 1);
    const std::size_t to = std::min(input.size(), at + 1 + below(20));
    const auto begin = input.begin() + static_cast<std::ptrdiff_t>(at);
    const auto end = input.begin() + static_cast<std::ptrdiff_t>(to);
    switch (below(6)) {
      case 0:
        if (at < input.size()) input[at] = static_cast<std::uint8_t>(input[at] ^ (1U << below(8)));
        break;
      case 1:
        input.erase(begin, end);
        break;
      case 2: {
        const Input copy(begin, end);
        const auto where = input.begin() + static_cast<std::ptrdiff_t>(below(input.size() + 1));
        input.insert(where, copy.begin(), copy.end());
        break;
      }
      case 3: {
        const Input bytes = noise(1 + below(4));
        input.insert(begin, bytes.begin(), bytes.end());
        break;
      }
      case 4: {
        // A character that means something in one of the formats.
        static const std::string letters = "0123456789.-+e,;:{}[]\"'#&*=!?<>()/^ \t\r\n";
        input.insert(begin, static_cast<std::uint8_t>(letters[below(letters.size())]));
        break;
      }
      default: {
        const Input& other = seeds_[below(seeds_.size())];
        input.erase(begin, input.end());
        input.insert(input.end(), other.begin() + static_cast<std::ptrdiff_t>(below(other.size() + 1)), other.end());
      }
    }
  }
};

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + std::min(argc, 1), argv + argc);
  const auto target = words.empty() ? fuzz::targets().end() : fuzz::targets().find(words[0]);
  if (target == fuzz::targets().end() || words.size() < 2) {
    fmt::print(stderr, "fuzz_replay TARGET SEED_FOLDER COUNT [KEEP] or fuzz_replay TARGET FILE; targets:");
    for (const auto& [name, run] : fuzz::targets()) fmt::print(stderr, " {}", name);
    fmt::print(stderr, "\n");
    return 2;
  }
  if (words.size() == 2) {
    const Input input = read(words[1]);
    return target->second(input.data(), input.size());
  }
  std::vector<Input> inputs = seeds_in(words[1]);
  const std::size_t seeds = inputs.size();
  Mutator mutator(inputs);
  const int count = std::atoi(words[2].c_str());
  for (int k = 0; k < count; ++k) inputs.push_back(mutator.next());
  for (const Input& input : inputs) {
    if (words.size() > 3) {
      std::ofstream(words[3], std::ios::binary)
          .write(reinterpret_cast<const char*>(input.data()), static_cast<std::streamsize>(input.size()));
    }
    target->second(input.data(), input.size());
  }
  fmt::print("{} seeds, {} changes\n", seeds, count);
}
