/// \file
/// Signs that the slopes of local models have to have.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "data/dataset.hpp"

namespace llmt {

/// Of a local model's coefficients [value, slopes]: -1, 0 (any) or 1. Empty: no slope has one.
std::vector<int> coefficient_signs(const TrainingRows& training);

/// Whether the slopes of a node's local model have the signs.
bool has_signs(const std::vector<int>& signs, const Node& node);

/// Moves a node's least-squares model to that under the signs, given the Gram matrix of [1, deviations / scale] of the
/// rows that it was fitted to. Adds what that costs to the node's RSS.
void keep_signs_by_gram(const std::vector<int>& signs, const Eigen::MatrixXd& gram, const Eigen::VectorXd& scale,
                        Node& node);

/// Moves a node's least-squares model to that under the signs, given what it was fitted to: deviations without missing
/// values and weights of the rows. Adds what that costs to the node's RSS.
void keep_signs(const std::vector<int>& signs, const Eigen::MatrixXd& deviations, const Eigen::VectorXd& weights,
                Node& node);

}  // namespace llmt
