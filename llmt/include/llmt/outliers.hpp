/// \file
/// Outputs that lie far from all others.
///
///     const llmt::HeavyRows heavy = llmt::heavy_rows(outputs.col(0));  // heavy.rows carry most of the squares
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/abi.hpp"

namespace llmt {

/// Where most of some values lie, whatever a minority of them is.
struct Bulk {
  double centre = 0.0;  ///< their median
  double spread = 0.0;  ///< 1.4826 times the median of |value - centre|: the standard deviation, if they are normal
};

/// Throws std::invalid_argument if there is no value.
Bulk bulk_of(const Eigen::Ref<const Eigen::VectorXd>& values);

/// A few rows whose outputs decide every fit by least squares.
struct HeavyRows {
  std::vector<Eigen::Index> rows = {};  ///< the farthest from the median first
  double share = 0.0;                   ///< of the sum of squares about the median that they carry
  /// The farthest value is so large that the spread of all others is below its rounding error: least squares cannot
  /// tell the others apart.
  bool hide_the_others = false;
};

/// The rows of an output that carry at least nine tenths of its sum of squares about the median, the smallest set of
/// such rows. Empty unless they are at most one row in a hundred (or one row), and each is more than 20 spreads (Bulk)
/// from the median. Throws std::invalid_argument if there is no value.
HeavyRows heavy_rows(const Eigen::Ref<const Eigen::VectorXd>& output);

}  // namespace llmt
