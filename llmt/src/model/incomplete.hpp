/// \file
/// Rows that lack an input which predictions depend on.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "llmt/intervals.hpp"
#include "llmt/model.hpp"

namespace llmt {

/// Of each row of `inputs` (as Model::predict() takes them), whether an input that one of the models uses is missing,
/// or is a category that no level names.
std::vector<bool> incomplete_rows(const std::vector<Model>& models, const Eigen::Ref<const Eigen::MatrixXd>& inputs);

/// The intervals of the folds' models with the absolute residuals of the rows that each fold held out.
Intervals held_out_intervals(std::vector<Model> models, const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                             const Eigen::Ref<const Eigen::MatrixXd>& outputs,
                             const std::vector<std::span<const int>>& held_out, int max_threads);

}  // namespace llmt
