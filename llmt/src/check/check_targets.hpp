/// \file
/// Errors of a model on new rows beside those of held-out rows.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "llmt/check.hpp"
#include "llmt/spread.hpp"

namespace llmt {

/// What a model says of a target at new rows, and what its held-out rows had there.
struct JudgedTarget {
  const OutputColumn& column;
  Eigen::VectorXd observed;    ///< NaN where not measured
  Eigen::VectorXd predicted;   ///< by the model of all rows
  Eigen::VectorXd spreads;     ///< mean spread of the parts
  Eigen::VectorXd lower = {};  ///< ends of the intervals; empty: too few held-out rows
  Eigen::VectorXd upper = {};
  std::vector<double> held_out;         ///< residuals of held-out rows, each divided by the spread at its row
  Eigen::VectorXi leaf_of = {};         ///< of each row; empty: no leaves
  std::vector<LeafRecord> leaves = {};  ///< as in the record; empty: not known
};

/// The fewest rows, of either kind, by which errors are judged.
inline constexpr Eigen::Index fewest_checked_rows = 10;

/// Errors and probabilities before Holm's correction; neither the limit nor a verdict.
CheckedTarget check_target(const JudgedTarget& judged);

}  // namespace llmt
