/// \file
/// How far a fit is.
#pragma once

#include <mutex>
#include <vector>

#include "base/work.hpp"
#include "data/fold_rows.hpp"
#include "fit/defaults.hpp"

namespace llmt {

/// Operations (base/work.hpp) of the growth of a tree on some rows, estimated before it is grown.
double operations_of_tree(const TrainingRows& rows, const Plan& plan);

/// Leaves that a tree on some rows may have.
Eigen::Index expected_leaves(const TrainingRows& rows, const Plan& plan);

/// Operations of what is left to do once the candidate is chosen.
double operations_of_finish(const TrainingRows& all, const Candidate& candidate);

/// The stages of the fit of one partition.
struct FitStages {
  FitStages(Work& work, std::size_t folds);

  /// Sets what is to come once the inputs are chosen.
  void expect(const TrainingRows& all, const std::vector<FoldRows>& folds, const Plan& plan) const;

  Stage inputs;  ///< the choice of them
  std::vector<Stage> fold_trees;
  Stage tree;  ///< of all rows
  Stage selection;
  Stage finish;
};

/// Tells FitOptions::progress the mean share of several partitions, in parts of `total`.
class ProgressReport {
 public:
  static constexpr Eigen::Index total = 1000;

  ProgressReport(const FitOptions& options, std::size_t partitions) : options_(options), shares_(partitions, 0.0) {}

  /// So much of the work of a partition is done.
  void partition_at(std::size_t partition, double share);

  void finish() { show(total); }

 private:
  void show(Eigen::Index parts);

  const FitOptions& options_;
  std::mutex mutex_;
  std::vector<double> shares_;
  Eigen::Index shown_ = 0;
};

}  // namespace llmt
