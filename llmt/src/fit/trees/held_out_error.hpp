/// \file
/// The error on held-out rows, by which codes, terms and inputs are chosen.
#pragma once

#include <vector>

#include "data/training.hpp"
#include "fit/plan/defaults.hpp"
#include "selection/selection.hpp"

namespace llmt {

/// The trees of the folds, and the candidate that predicts held-out rows best.
struct HeldOutFits {
  std::vector<GrownTree> trees;
  Selection selection;
};

/// Grows a tree for the outputs `served` in every fold without the rows that it holds out, and compares the candidates
/// of the plan on these rows. selection.chosen has the root mean square errors: with e_i the error of the held-out row
/// i and w_i its weight,
///
///     rmse = sqrt(sum_i w_i e_i^2 / sum_i w_i),    fold_rmse(k): the same sums over the rows of fold k.
///
/// `work`: of this. `grown`: the tree of the only fold where it is known, else null. Throws std::runtime_error if the
/// candidates would take more memory than there is.
HeldOutFits held_out_error(const Training& training, const Plan& plan, const std::vector<int>& served, Work& work,
                           const GrownTree* grown = nullptr);

/// The errors of several partitions as one: their mean, each in parts of that of `units`. A single one is its own.
CandidateError mean_error(const std::vector<CandidateError>& errors, const std::vector<CandidateError>& units);

/// Throws std::runtime_error if a fit with at most `leaves` leaves takes more memory than there is. 0: before the
/// leaves are known.
void refuse_beyond_memory(const Training& training, const Plan& plan, Eigen::Index leaves);

}  // namespace llmt
