/// \file
/// What a selection compares, and what it returns.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "data/fold_rows.hpp"
#include "estimation/estimate.hpp"

namespace llmt {

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
  Eigen::Index held_out_rows = 0;  ///< that errors are from
  std::vector<Partition> made;     ///< the chosen candidate in every fold, if it had to be made; else empty
};

}  // namespace llmt
