/// \file
/// The spread of errors, learnt from held-out rows.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/partition.hpp"
#include "llmt/spread.hpp"

namespace llmt {

/// Held-out rows with fewer of which no spread is learnt: it would be noise, and widen intervals (measured at 30 and 60
/// rows).
inline constexpr Eigen::Index fewest_rows_of_spread = 100;

/// Parts to which the rows of a single fold are dealt.
inline constexpr int parts_of_one_fold = 5;

/// Held-out rows that spreads are learnt from.
struct ErrorRows {
  Eigen::Ref<const Eigen::MatrixXd> inputs;  ///< rows x inputs, categories as positions
  const std::vector<InputColumn>& columns;   ///< of the inputs
  Eigen::VectorXd predictions;               ///< of each row, of the model that has not seen it
  Eigen::VectorXd errors;                    ///< absolute ones
  Eigen::VectorXd weights = {};              ///< positive, of precision; empty: none
};

/// One spread for each of `parts` parts, (I.1) of docs/algorithms/intervals.md, learnt from the rows of the other
/// parts. `part`: of each row. Spreads without nodes if the rows are too few; even ones if the errors of all parts but
/// one are zero.
std::vector<Spread> fit_spreads(const ErrorRows& rows, const std::vector<int>& part, int parts);

/// Numbers 0 ... parts - 1 of `rows` rows, as many of each, at random.
std::vector<int> dealt_parts(Eigen::Index rows, int parts);

}  // namespace llmt
