/// \file
/// Regressors without a value (NaN): local models take them at the mean of a node's rows.
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "base/matrix.hpp"
#include "data/dataset.hpp"

namespace llmt {

/// Deviations of the regressors from their centres in all rows, rows x regressors; NaN: missing.
RowMajor all_deviations(const TrainingRows& rows);

/// `x` (rows x regressors) with `mean` (one entry per regressor) in place of missing values.
RowMajor imputed(const RowMajor& x, const Eigen::VectorXd& mean);

/// A deviation of a regressor from its centre, with the mean over the node's rows in place of a missing value.
inline double imputed(const Node& node, Eigen::Index regressor, double deviation) {
  return std::isnan(deviation) ? node.mean(regressor) : deviation;
}

/// The same for the deviations of all regressors of a row.
inline Eigen::VectorXd imputed(const Node& node, const Eigen::Ref<const Eigen::RowVectorXd>& deviations) {
  return deviations.transpose().array().isNaN().select(node.mean, deviations.transpose());
}

/// Weighted mean of the values of a column that are not missing; 0 if all are. `weights`: one per row.
double mean_of_present(const RowMajor& x, Eigen::Index column, const Eigen::VectorXd& weights);

}  // namespace llmt
