/// \file
/// Which candidate predicts held-out rows best.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/progress.hpp"
#include "selection/candidates.hpp"

namespace llmt {

/// A fold's held-out rows that are looked at; of more a sample.
inline constexpr Eigen::Index most_held_out_rows = 10000;

/// Whether the gain of `other` on `simple` is beyond chance: more than two standard errors of the paired differences of
/// the folds. A single hold-out has no such measure.
bool is_beyond_chance(const CandidateError& simple, const CandidateError& other);

/// Compares on the held-out rows of all folds, see docs/algorithms.md, section 7. `grown`: of each fold the tree grown
/// without its held-out rows. `work`: of this comparison.
Selection select(const std::vector<FoldRows>& folds, const std::vector<GrownTree>& grown, const Candidates& candidates,
                 const Eigen::VectorXd& weights, int max_threads, Work& work);

}  // namespace llmt
