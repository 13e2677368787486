/// \file
/// Whether predictions are clamped to the range of the training rows: docs/algorithms/guards.md, B.5.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "data/fold_rows.hpp"
#include "llmt/summary.hpp"

namespace llmt {

/// Judges the guard of each output of a partition on the held-out rows, and sets it in the folds' partitions where it
/// is taken. `of_folds`: the chosen candidate in every fold, each without an output_range; `weights`: of the outputs'
/// squared errors. If an output is clamped, the errors of `chosen` become those of the clamped partitions.
std::vector<RangeGuard> guard_output_range(const std::vector<FoldRows>& folds, const Eigen::VectorXd& weights,
                                           int max_threads, std::vector<Partition>& of_folds, CandidateError& chosen);

/// Partition::output_range of a partition that serves the given outputs and was made from `training`; empty if no guard
/// is taken.
Eigen::MatrixXd output_range(const std::vector<RangeGuard>& guards, const std::vector<int>& outputs,
                             const TrainingRows& training);

}  // namespace llmt
