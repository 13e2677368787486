/// \file
/// Prediction intervals from the rows that folds held out.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "llmt/intervals.hpp"

namespace llmt {

/// The intervals of the folds' models with the absolute residuals of the rows that each fold held out. `precisions`:
/// weights of all rows; empty: none.
Intervals held_out_intervals(std::vector<Model> models, const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                             const Eigen::Ref<const Eigen::MatrixXd>& outputs, const Eigen::VectorXd& precisions,
                             const std::vector<std::span<const int>>& held_out, int max_threads);

}  // namespace llmt
