/// \file
/// A model as pictures: its tree with conditions and slopes, and for two inputs its boxes and its surface.
#pragma once

#include <vector>

#include "llmt/model.hpp"
#include "report/document/document.hpp"

namespace llmt::report {

/// The tree of a partition as a block. `inputs`: the training rows; a slope's bar is as long as the change that it
/// makes between the lower and the upper quartile of its input.
Json tree_block(const Model& model, Eigen::Index partition, const Eigen::MatrixXd& inputs, const std::string& title,
                const std::string& caption);

/// Numeric inputs that the model splits on or has slopes for, ascending.
std::vector<int> used_numbers(const Model& model);

/// Boxes and surface of a model whose prediction depends on two numbers alone; empty for all others.
std::vector<Json> plane_blocks(const Model& model, Eigen::Index output, const Eigen::MatrixXd& inputs,
                               const Eigen::VectorXd& observed);

}  // namespace llmt::report
