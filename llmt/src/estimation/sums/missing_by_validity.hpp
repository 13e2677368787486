/// \file
/// What stands for a missing value in a partition whose leaves overlap (docs/algorithms/data.md).
#pragma once

#include "data/dataset.hpp"
#include "estimation/sums/normal_equations.hpp"
#include "partition/evaluator.hpp"

namespace llmt {

/// Sets for each node but the root Node::mean to the mean of the regressors over the rows that have them, weighted by
/// the validity of the node's leaves. Adds to Node::missing_left of a split on a number what the mean of the left
/// child's validity gate over the node is larger than the part of the rows that lie on the left of the threshold.
/// Growth has set both from the rows in the boxes. `leave_out`: rows that a missing value sends to several leaves take
/// no part.
void describe_missing_by_validity(const TrainingRows& training, const Evaluator& evaluator, bool leave_out,
                                  Partition& partition, int max_threads);

/// The same for rows without missing values, from their sums. `scale`: of the regressors.
void describe_missing_by_sums(const NormalEquations& sums, const Eigen::VectorXd& scale, Partition& partition);

}  // namespace llmt
