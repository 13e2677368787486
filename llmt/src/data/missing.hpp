/// \file
/// Deviations of the regressors in all rows, some of which may be missing (NaN).
#pragma once

#include <Eigen/Core>

#include "base/matrix.hpp"
#include "data/dataset.hpp"

namespace llmt {

/// Deviations of the regressors from their centres in all rows, rows x regressors; NaN: missing.
RowMajor all_deviations(const TrainingRows& rows);

/// Weighted mean of the values of a column that are not missing; 0 if all are. `weights`: one per row.
double mean_of_present(const RowMajor& x, Eigen::Index column, const Eigen::VectorXd& weights);

}  // namespace llmt
