/// \file
/// The error that any model must beat: that of the mean of the rows.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "report/fit/fit_summary.hpp"

namespace llmt::report {

/// What the line of the mean is called in tables of errors.
inline constexpr const char* mean_of_rows = "mean of the rows";

struct ErrorOfMean {
  double rmse = 0.0;    ///< on held-out rows, of the mean of the others; NaN where none is held out
  double spread = 0.0;  ///< of the folds; 0 of a single one
  double train = 0.0;   ///< of the mean of all rows, on these
};

/// Of one output. `held_out`: the rows of each fold; `weights`: of the rows, of 0 where a row does not count; empty:
/// all 1.
ErrorOfMean error_of_mean(const Eigen::Ref<const Eigen::VectorXd>& output, const Eigen::VectorXd& weights,
                          const std::vector<std::vector<Eigen::Index>>& held_out);

/// Weights of the rows of a fit, 0 of those that its loss left out; empty: all 1.
Eigen::VectorXd counted_weights(const FitRun& run, const FitResult& result);

/// The same of the rows of a fit, without those that its loss left out.
ErrorOfMean error_of_mean(const FitRun& run, const FitResult& result, Eigen::Index output);

}  // namespace llmt::report
