#include "study/shuffle_split.hpp"

#include <bit>
#include <numeric>
#include <random>
#include <utility>

namespace bench {
namespace {

// NumPy's random_interval(): uniform on 0 ... most. Of the generator's bits only as many are kept as `most` has, and
// numbers above it are drawn again.
std::uint32_t uniform_up_to(std::uint32_t most, std::mt19937& generator) {
  const auto mask = static_cast<std::uint32_t>((std::uint64_t{1} << std::bit_width(most)) - 1);
  std::uint32_t number = 0;
  do {
    number = static_cast<std::uint32_t>(generator()) & mask;
  } while (number > most);
  return number;
}

}  // namespace

SplitRows shuffle_split(Eigen::Index rows, std::uint32_t seed) {
  // NumPy seeds its Mersenne twister as the C++ standard says (init_genrand of Matsumoto and Nishimura).
  std::mt19937 generator(seed);
  std::vector<Eigen::Index> order(static_cast<std::size_t>(rows));
  std::iota(order.begin(), order.end(), 0);
  for (std::size_t last = order.size(); last-- > 1;) {
    std::swap(order[last], order[uniform_up_to(static_cast<std::uint32_t>(last), generator)]);
  }
  const auto train = order.begin() + (rows + 3) / 4;
  return {{train, order.end()}, {order.begin(), train}};
}

}  // namespace bench
