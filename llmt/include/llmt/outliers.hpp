/// \file
/// Outputs that lie far from all others.
///
///     const llmt::DominantRows dominant = llmt::dominant_rows(outputs.col(0));
///     const bool few_decide = dominant.share > 0.9;  // dominant.rows carry most of the squares
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/abi.hpp"

namespace llmt {

/// Location and scale of some values, whatever a minority of them is.
struct RobustScale {
  double median = 0.0;
  /// 1.4826 times the median absolute deviation (MAD), the median of |value - median|: the standard deviation, if the
  /// values are normal.
  double deviation = 0.0;
};

/// Throws std::invalid_argument if there is no value.
RobustScale robust_scale(const Eigen::Ref<const Eigen::VectorXd>& values);

/// A few rows whose outputs decide every fit by least squares.
struct DominantRows {
  std::vector<Eigen::Index> rows = {};  ///< the farthest from the median first
  double share = 0.0;                   ///< of the sum of squares about the median that they carry
  /// The farthest value is so large that the spread of all others is below its rounding error: least squares cannot
  /// tell the others apart.
  bool hide_the_others = false;
};

/// The rows of an output that carry at least nine tenths of its sum of squares about the median, the smallest set of
/// such rows. Empty unless they are at most one row in a hundred (or one row), and each is more than 20
/// deviations (RobustScale) from the median. Throws std::invalid_argument if there is no value.
DominantRows dominant_rows(const Eigen::Ref<const Eigen::VectorXd>& output);

}  // namespace llmt
