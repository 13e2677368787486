#include "llmt/gaps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace llmt {

bool is_in(const Gap& gap, const Eigen::Ref<const Eigen::MatrixXd>& inputs, Eigen::Index row) {
  return std::ranges::all_of(gap.sides, [&](const GapSide& side) {
    const double value = inputs(row, side.column);
    return side.low < value && value < side.high;
  });
}

std::vector<Eigen::Index> rows_in_gaps(const std::vector<Gap>& gaps, const Eigen::Ref<const Eigen::MatrixXd>& inputs) {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index row = 0; row < inputs.rows(); ++row) {
    if (std::ranges::any_of(gaps, [&](const Gap& gap) { return is_in(gap, inputs, row); })) rows.push_back(row);
  }
  return rows;
}

void check_gaps(const std::vector<Gap>& gaps, Eigen::Index inputs) {
  for (const Gap& gap : gaps) {
    if (gap.sides.empty()) throw std::invalid_argument("llmt::Gap: it has no side");
    for (const GapSide& side : gap.sides) {
      if (side.column < 0 || side.column >= inputs) {
        throw std::invalid_argument(fmt::format("llmt::Gap: there is no column {} of {}", side.column, inputs));
      }
      if (!(std::isfinite(side.low) && std::isfinite(side.high) && side.low < side.high)) {
        throw std::invalid_argument(
            fmt::format("llmt::Gap: column {} from {} to {} is no range", side.column, side.low, side.high));
      }
    }
  }
}

}  // namespace llmt
