/// \file
/// The ends of prediction intervals.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/abi.hpp"

namespace llmt {

/// Lower and upper ends, rows x outputs.
struct Bounds {
  Eigen::MatrixXd lower;
  Eigen::MatrixXd upper;
  /// Rows that lack an input for which there were too few held-out rows like them for the level. Their intervals are
  /// likely too narrow, see Intervals.
  std::vector<Eigen::Index> uncalibrated = {};
};

/// The bounds, widened where needed so that they hold the predictions of the model. Folds' models may all lie on one
/// side of it.
Bounds holding(Bounds bounds, const Eigen::Ref<const Eigen::MatrixXd>& predictions);

}  // namespace llmt
