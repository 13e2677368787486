/// \file
/// Statistics of a finished partition's leaves.
#pragma once

#include <Eigen/Core>

#include "data/dataset.hpp"
#include "llmt/progress.hpp"

namespace llmt {

/// Sets what a finished partition says of its nodes: residual sums of squares, and the leaves' inverse Gram matrices.
/// `sparse`: the matrices are those of the regressors with slopes alone. `work`: reports on the way, and may stop it.
void describe_leaves(const TrainingRows& training, Partition& partition, bool sparse, int max_threads, Work& work);

/// Counts the rows in each node anew, for a tree that was grown from others.
void count_rows(const TrainingRows& rows, Partition& partition);

/// Pseudo-inverse of a Gram matrix whose columns are about as large as `scale`. Eigenvalues have a floor, so that a
/// direction without rows has a large leverage, not an infinite one.
Eigen::MatrixXd inverse_gram(const Eigen::MatrixXd& gram, const Eigen::VectorXd& scale);

}  // namespace llmt
