#include "boosted/memory.hpp"

#include <fmt/format.h>

#include <stdexcept>

namespace llmt {

double estimated_memory(const SumSize& size) {
  // Copies, in doubles: of the table with its bins and features, and of the features that are levels.
  // docs/algorithms/numerics.md sets the estimate beside measured peaks.
  constexpr double of_table = 6.0;
  constexpr double of_levels = 2.0;
  const auto columns = static_cast<double>(size.inputs + size.outputs);
  return sizeof(double) * static_cast<double>(size.rows) *
         (of_table * columns + of_levels * static_cast<double>(size.levels));
}

void refuse_beyond_memory(const SumSize& size, std::uintmax_t available) {
  const double estimate = estimated_memory(size);
  if (estimate <= static_cast<double>(available)) return;
  const std::string levels = size.levels == 0 ? "" : fmt::format(" and {} levels of categories", size.levels);
  throw std::runtime_error(fmt::format(
      "a sum of trees of {} rows with {} inputs{} needs about {:.1f} GB of memory, this machine has {:.1f} GB; take "
      "fewer rows, or one tree of a stream",
      size.rows, size.inputs, levels, estimate / 1e9, static_cast<double>(available) / 1e9));
}

}  // namespace llmt
