/// \file
/// Weights of rows by which outliers in the outputs lose their influence.
#pragma once

#include <Eigen/Core>

#include "data/training.hpp"
#include "llmt/progress.hpp"

namespace llmt {

/// Tukey's biweight of the residuals of two preliminary crisp trees (docs/algorithms/robust.md): one weight in [0, 1]
/// for each row, 0 for outliers. The weights of the rows are not multiplied in. `options` are checked; `work`: of this.
Eigen::VectorXd robust_weights(const GivenRows& given, const FitOptions& options, Work& work);

/// The weights that rows have in errors: `given` (empty: 1), but 0 for rows whose robust weight is 0.
Eigen::VectorXd without_outliers(const Eigen::VectorXd& given, const Eigen::VectorXd& robust);

}  // namespace llmt
