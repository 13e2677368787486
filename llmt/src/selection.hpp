/// \file
/// Which candidate predicts held-out rows best.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "estimate.hpp"
#include "training.hpp"

namespace llmt {

/// What a fold trains on, and what it holds out.
struct FoldRows {
  TrainingRows training;
  TrainingRows held_out;
};

/// What the candidates are.
struct Candidates {
  bool crisp = true;
  ValidityKind kind = ValidityKind::blend;  ///< of the others
  Estimation estimation = Estimation::joint;
  std::vector<double> widths;  ///< empty: crisp alone
  std::vector<double> jumps;   ///< see Candidate::jump; none first
  std::vector<double> ridges;
  std::vector<double> shrinkages;
  std::vector<bool> sparse = {false};  ///< see Candidate::sparse
};

struct Selection {
  CandidateError chosen;
  std::vector<CandidateError> best_of_kind;
  Eigen::VectorXd crisp_rmse;
  std::ptrdiff_t held_out_rows = 0;  ///< that errors are from
  std::vector<Partition> made;       ///< the chosen candidate in every fold, if it had to be made; else empty
};

/// Whether the gain of `other` on `simple` is beyond chance: more than two standard errors of the paired differences of
/// the folds. A single hold-out has no such measure.
bool is_beyond_chance(const CandidateError& simple, const CandidateError& other);

/// Compares on the held-out rows of all folds, see docs/algorithms.md, section 7. `grown`: of each fold the tree grown
/// without its held-out rows.
Selection select(const std::vector<FoldRows>& folds, const std::vector<GrownTree>& grown, const Candidates& candidates,
                 const Eigen::VectorXd& weights, int max_threads);

}  // namespace llmt
