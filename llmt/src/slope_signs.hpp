/// \file
/// Signs that the slopes of local models have to have.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "training.hpp"

namespace llmt {

/// Of a local model's coefficients [value, slopes]: -1, 0 (any) or 1. Empty: no slope has one.
std::vector<int> coefficient_signs(const TrainingRows& training);

/// Moves a node's least-squares model to that under the signs, given what it was fitted to: deviations without missing
/// values and weights of the rows. Adds what that costs to the node's RSS.
void keep_signs(const std::vector<int>& signs, const Eigen::MatrixXd& deviations, const Eigen::VectorXd& weights,
                Node& node);

/// The same for all nodes of a tree whose local models are the least-squares models of the rows in their boxes. A tree
/// that has the signs stays as it is.
void keep_signs(const TrainingRows& training, Partition& grown, int max_threads);

}  // namespace llmt
