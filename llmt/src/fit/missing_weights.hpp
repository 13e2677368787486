/// \file
/// Weights of rows by what is missing in them.
#pragma once

#include <Eigen/Core>

#include "data/dataset.hpp"
#include "llmt/options.hpp"

namespace llmt {

/// The weight (D.3) of each row, in (0, 1]: the residual variance of rows without missing values divided by that of
/// rows in which the same inputs are missing (docs/algorithms/data.md). 1 where nothing is missing. `options` are those
/// of the fit; `work` counts a tenth of itself as done.
Eigen::VectorXd weights_by_missing(const TrainingRows& all, const FitOptions& options, Work& work);

}  // namespace llmt
