/// \file
/// What a selection compares, and what it returns.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "data/fold_rows.hpp"
#include "estimation/estimate.hpp"

namespace llmt {

/// The kinds of models that held-out rows decide among.
struct Candidates {
  bool crisp = true;
  ValidityKind kind = ValidityKind::blend;  ///< of the others
  Estimation estimation = Estimation::joint;
  std::vector<double> widths;  ///< empty: crisp alone
  std::vector<double> jumps;   ///< see Candidate::jump; none first
  std::vector<double> ridges;
  std::vector<double> shrinkages;
  std::vector<bool> sparse = {false};          ///< see Candidate::sparse
  std::vector<double> linear_shrinkages = {};  ///< of one leaf, besides none; in rows, towards slopes of 0
};

struct Selection {
  CandidateError chosen;
  CandidateError linear;  ///< least squares, or the ridge regression that predicts better
  std::vector<CandidateError> best_of_kind;
  Eigen::VectorXd crisp_rmse;
  Eigen::Index held_out_rows = 0;  ///< that errors are from
  /// The chosen candidate in each fold, where it was made from all training rows. Empty: in none.
  std::vector<std::optional<Partition>> made;
};

}  // namespace llmt
