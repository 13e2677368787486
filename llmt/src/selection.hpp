/// \file
/// Which candidate predicts held-out rows best.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "training.hpp"

namespace llmt {

/// What a fold trains on, and what it holds out.
struct FoldRows {
  TrainingRows training;
  TrainingRows held_out;
};

/// A grown tree, and how far the outputs jump at its splits.
struct GrownTree {
  Partition partition;
  Eigen::VectorXd jumps;  ///< of every node, see jump_sizes()
};

/// What the candidates are.
struct Candidates {
  bool crisp = true;
  ValidityKind kind = ValidityKind::blend;  ///< of the others
  Estimation estimation = Estimation::joint;
  int smoothness = 1;
  std::vector<double> widths;  ///< empty: crisp alone
  std::vector<double> jumps;   ///< see Candidate::jump
  std::vector<double> ridges;
  std::vector<double> shrinkages;
};

struct Selection {
  CandidateError chosen;
  std::vector<CandidateError> best_of_kind;
  Eigen::VectorXd crisp_rmse;
};

/// Partition::outer_slope of a grown tree: the root's slope, as far as the first leaves agree on it. Shrunk by their
/// mean square spread about it, like a James-Stein estimate.
Eigen::MatrixXd agreed_slope(const Partition& grown);

/// Sum of weighted squared errors of the prefixes of `partition` with 1, 2, ..., num_leaves leaves, as grown and crisp,
/// over some rows. `weights`: of the outputs' squared errors.
Eigen::VectorXd prefix_squared_errors(const Partition& partition, const TrainingRows& rows,
                                      const Eigen::VectorXd& weights);

/// Sum of weighted squared errors over some rows.
double squared_error(const Partition& partition, const TrainingRows& rows, const Eigen::VectorXd& weights);

/// The partition with `candidate`'s leaves, validity and estimates.
Partition estimate(const TrainingRows& training, const GrownTree& grown, const Candidate& candidate, int max_threads);

/// Compares on the held-out rows of all folds. First every width on as many folds as hold enough rows, leaf counts in
/// steps of a half until two steps brought nothing; then the best two widths near their best leaf counts and ridges on
/// the other folds.
/// `grown`: of each fold the tree grown without its held-out rows.
Selection select(const std::vector<FoldRows>& folds, const std::vector<GrownTree>& grown, const Candidates& candidates,
                 const Eigen::VectorXd& weights, int max_threads);

}  // namespace llmt
