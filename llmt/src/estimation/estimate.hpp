/// \file
/// From a grown tree to a model, and its errors on rows.
#pragma once

#include <Eigen/Core>

#include "data/dataset.hpp"
#include "llmt/summary.hpp"

namespace llmt {

/// A grown tree, and how far the outputs jump at its splits.
struct GrownTree {
  Partition partition;
  Eigen::VectorXd jumps;  ///< of every node, see jump_sizes()
};

/// Partition::outer_slope of a grown tree: the root's slope, as far as the first leaves agree on it. Shrunk by their
/// mean square spread about it, like a James-Stein estimate.
Eigen::MatrixXd agreed_slope(const Partition& grown);

/// The tree with half widths for a validity; splits with a jump of at least `jump` stay crisp.
Partition blended(const TrainingRows& training, const GrownTree& grown, const Validity& validity, double jump);

/// The partition with `candidate`'s leaves, validity and estimates.
Partition estimate(const TrainingRows& training, const GrownTree& grown, const Candidate& candidate, int max_threads);

/// Sum of weighted squared errors of the prefixes of `partition` with 1, 2, ..., num_leaves leaves, as grown and crisp,
/// over some rows. `weights`: of the outputs' squared errors.
Eigen::VectorXd prefix_squared_errors(const Partition& partition, const TrainingRows& rows,
                                      const Eigen::VectorXd& weights, int max_threads);

/// Sum of weighted squared errors over rows that are at hand, for they are looked at again and again. `columns`: what
/// they were fetched from.
double squared_error(const Partition& partition, const TrainingRows& columns, const std::vector<Chunk>& rows,
                     const Eigen::VectorXd& weights);

/// Pseudo-inverse of a Gram matrix whose columns are about as large as `scale`, with a floor: a direction without rows
/// has a large leverage, not an infinite one.
Eigen::MatrixXd inverse_gram(const Eigen::MatrixXd& gram, const Eigen::VectorXd& scale);

/// Fills in what a finished partition tells of its leaves: residual sums of squares and inverse Gram matrices.
/// `sparse`: these are of the regressors with slopes alone.
void describe_leaves(const TrainingRows& training, Partition& partition, bool sparse, int max_threads);

}  // namespace llmt
