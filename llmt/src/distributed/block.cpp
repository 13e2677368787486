#include "distributed/block.hpp"

#include <utility>

namespace llmt::distributed {

Sample& Sample::operator+=(const Sample& other) {
  if (other.hashes.empty()) return *this;
  if (hashes.empty()) return *this = other;
  const std::size_t columns = values.size() / hashes.size();
  Sample both;
  both.most = most;
  std::size_t a = 0;
  std::size_t b = 0;
  while (std::ssize(both.hashes) < most && (a < hashes.size() || b < other.hashes.size())) {
    const bool own = b == other.hashes.size() || (a < hashes.size() && hashes[a] <= other.hashes[b]);
    const Sample& from = own ? *this : other;
    std::size_t& at = own ? a : b;
    both.hashes.push_back(from.hashes[at]);
    const auto row = from.values.begin() + static_cast<std::ptrdiff_t>(at * columns);
    both.values.insert(both.values.end(), row, row + static_cast<std::ptrdiff_t>(columns));
    ++at;
  }
  return *this = std::move(both);
}

}  // namespace llmt::distributed
