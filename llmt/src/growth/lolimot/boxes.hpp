/// \file
/// Boxes of LOLIMOT's local models: which rows lie in them, how much they count elsewhere, and where they are cut.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "growth/problem.hpp"

namespace llmt {

/// The training rows in the form that LOLIMOT works with. Outputs are not scaled, as they are in GrowthData: the rule
/// compares sums of squares only, and each output's is divided by its total.
struct LolimotData {
  explicit LolimotData(const GrowthProblem& problem);

  const GrowthProblem& problem;
  Eigen::MatrixXd deviations;      ///< of the regressors, rows x regressors; a missing value is 0, the mean
  Eigen::MatrixXd split_values;    ///< rows x split inputs; NaN: missing
  Eigen::MatrixXd outputs;         ///< rows x outputs
  Eigen::VectorXd weights;         ///< of the rows, with mean 1
  Eigen::VectorXd output_weights;  ///< of the outputs' sums of squares: 1 / their total about the mean
  std::vector<int> signs;          ///< prescribed signs of the coefficients; empty: none

  bool is_categorical(Eigen::Index split_input) const;
};

/// Low and high side along each split input.
struct Box {
  Eigen::VectorXd low;
  Eigen::VectorXd high;
};

/// Validity function of a box before normalisation (docs/algorithms/validities.md, V.5), one entry per row. `width`:
/// see LolimotOptions. Rows without a value count as lying in the middle of the box in that direction.
Eigen::VectorXd validity_function(const LolimotData& data, const Box& box, double width);

/// Rows whose values lie in the box. A row without a value lies in a box only if the box reaches from end to end of
/// `whole`, the extent of the training rows, in that direction.
std::vector<int> rows_in(const LolimotData& data, const Box& box, const Box& whole);

/// The middle of the box along a split input; none for categories and where the box has no extent.
std::optional<double> middle_of(const LolimotData& data, const Box& box, Eigen::Index split_input);

/// Where two crisp local models of the given rows leave the smallest RSS: halfway between two values of the split
/// input. None for categories, and if no threshold leaves min_leaf_samples on both sides.
std::optional<double> best_threshold_of(const LolimotData& data, const std::vector<int>& rows,
                                        Eigen::Index split_input);

}  // namespace llmt
