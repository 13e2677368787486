/// \file
/// Signs that slopes of local models are required to have.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "data/dataset.hpp"

namespace llmt {

/// The required sign of each of a local model's coefficients [value, slopes]: -1, 0 (any) or 1. Empty if no slope has
/// one.
std::vector<int> coefficient_signs(const TrainingRows& training);

/// Whether the slopes of a node's local model have the signs.
bool has_signs(const std::vector<int>& signs, const Node& node);

/// Replaces a node's least-squares model by the least-squares model under the signs. `gram`: the Gram matrix of
/// [1, deviations / scale] over the rows that it was fitted to. Adds the increase to the node's RSS.
void keep_signs_by_gram(const std::vector<int>& signs, const Eigen::MatrixXd& gram, const Eigen::VectorXd& scale,
                        Node& node);

/// The same, given the rows that the model was fitted to: their deviations, without missing values, and weights.
void keep_signs(const std::vector<int>& signs, const Eigen::MatrixXd& deviations, const Eigen::VectorXd& weights,
                Node& node);

}  // namespace llmt
