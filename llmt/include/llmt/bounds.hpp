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
  /// Rows that lie in a Gap of the training rows. Their intervals are wider than their errors alone would make them.
  std::vector<Eigen::Index> in_gap = {};
};

/// The bounds, widened where needed so that they hold the predictions of the model. Folds' models may all lie on one
/// side of it.
Bounds holding(Bounds bounds, const Eigen::Ref<const Eigen::MatrixXd>& predictions);

/// The levels |1 - 2 p| of the intervals one end of which is the quantile of probability p, one for each p but 1/2.
/// Throws std::invalid_argument if a probability is not between 0 and 1, or they do not ascend.
std::vector<double> levels_of_quantiles(const std::vector<double>& probabilities);

/// Quantiles of each output, rows x probabilities: the lower end of the interval for p < 1/2, the upper end for
/// p > 1/2, and the prediction for p = 1/2. They are put in ascending order in each row, so that they do not cross
/// (Chernozhukov, Fernandez-Val & Galichon 2010). `bounds`: at the levels of levels_of_quantiles().
std::vector<Eigen::MatrixXd> quantiles_from(const std::vector<Bounds>& bounds,
                                            const Eigen::Ref<const Eigen::MatrixXd>& predictions,
                                            const std::vector<double>& probabilities);

}  // namespace llmt
