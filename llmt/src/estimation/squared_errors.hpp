/// \file
/// Squared errors of partitions on rows.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "data/dataset.hpp"

namespace llmt {

/// Sums of the weighted squared errors, over some rows, of the prefixes of `partition` with 1, 2, ..., num_leaves
/// leaves, crisp and with the models that the nodes have, each with the outer slope that it has as a candidate of its
/// own, see grown_prefix(). `grown`: the same tree with the models as grown. `weights`: of the outputs' squared errors.
Eigen::VectorXd prefix_squared_errors(const Partition& partition, const Partition& grown, const TrainingRows& rows,
                                      const Eigen::VectorXd& weights, int max_threads);

/// Parts of the rows of which squared errors are told apart: their scatter shows how certain a difference is.
inline constexpr Eigen::Index error_parts = 16;

/// Weighted squared errors over rows that were fetched before, for callers that use the same rows many times, summed
/// over each of error_parts parts of the rows, in their order. `rows`: as from fetch_all(); `columns`: what they were
/// fetched from.
/// `partitions`: they differ in the values and slopes of their local models alone.
std::vector<Eigen::VectorXd> squared_errors(const std::vector<Partition>& partitions, const TrainingRows& columns,
                                            const std::vector<Chunk>& rows, const Eigen::VectorXd& weights);
Eigen::VectorXd squared_errors(const Partition& partition, const TrainingRows& columns, const std::vector<Chunk>& rows,
                               const Eigen::VectorXd& weights);

}  // namespace llmt
