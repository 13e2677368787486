/// \file
/// Rows that lack an input which predictions depend on.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/model.hpp"

namespace llmt {

/// For each row of `inputs` (as Model::predict() takes them): whether an input that one of the models uses is missing,
/// or is a category that no level names.
std::vector<bool> incomplete_rows(const std::vector<Model>& models, const Eigen::Ref<const Eigen::MatrixXd>& inputs);

}  // namespace llmt
