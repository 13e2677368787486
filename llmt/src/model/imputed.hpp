/// \file
/// Missing regressors of a local model.
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "base/matrix.hpp"
#include "llmt/model.hpp"

namespace llmt {

/// A deviation of a regressor from its centre; the mean over the node's rows if it is missing (NaN).
inline double imputed(const Node& node, Eigen::Index regressor, double deviation) {
  return std::isnan(deviation) ? node.mean(regressor) : deviation;
}

/// The same for all regressors of a row.
inline Eigen::VectorXd imputed(const Node& node, const Eigen::Ref<const Eigen::RowVectorXd>& deviations) {
  return deviations.transpose().array().isNaN().select(node.mean, deviations.transpose());
}

/// `x` (rows x regressors) with `mean`, one entry per regressor, in place of missing values.
inline RowMajor imputed(const RowMajor& x, const Eigen::VectorXd& mean) {
  return x.array().isNaN().select(mean.transpose().replicate(x.rows(), 1), x);
}

}  // namespace llmt
