/// \file
/// Boxes within the range of the training rows that hold none of them.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/abi.hpp"

namespace llmt {

/// From where to where an input lies in a Gap; the ends lie outside.
struct GapSide {
  int column = 0;
  double low = 0.0;
  double high = 0.0;

  bool operator==(const GapSide&) const = default;
};

/// A box of some inputs in which no training row lies, although there would be many if the inputs were independent.
struct Gap {
  std::vector<GapSide> sides;

  bool operator==(const Gap&) const = default;
};

/// Whether a row of `inputs` lies in a gap: every side holds its value, which is not missing.
bool is_in(const Gap& gap, const Eigen::Ref<const Eigen::MatrixXd>& inputs, Eigen::Index row);

/// The rows of `inputs`, ascending, that lie in one of the gaps.
std::vector<Eigen::Index> rows_in_gaps(const std::vector<Gap>& gaps, const Eigen::Ref<const Eigen::MatrixXd>& inputs);

/// Throws std::invalid_argument if a gap does not fit `inputs` inputs: no side, a column out of range, ends that are
/// not finite or do not ascend.
void check_gaps(const std::vector<Gap>& gaps, Eigen::Index inputs);

}  // namespace llmt
