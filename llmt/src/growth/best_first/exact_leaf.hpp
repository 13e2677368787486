/// \file
/// A leaf of a growing tree with the values of its own rows.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "growth/growth_data.hpp"

namespace llmt {

struct ExactLeaf {
  RowMajor inputs;                       ///< of the rows, all columns; NaN: missing
  Eigen::VectorXd weights;               ///< of the rows in this leaf
  std::vector<std::vector<int>> orders;  ///< rows by each numeric split input that has a value, ascending; RA: empty
  /// Rows x outputs. They are those of the parent's model until the leaf is examined, then those of its own.
  Eigen::MatrixXd residuals;

  double split_value(const GrowthData& data, Eigen::Index row, Eigen::Index split_input) const {
    return inputs(row, data.problem.options.split_inputs[split_input]);
  }
};

/// Deviations of the regressors in the leaf's rows, rows x regressors; NaN: missing.
RowMajor deviations_in(const GrowthData& data, const ExactLeaf& leaf);

/// Level of each row of the leaf in a categorical split input, -1 where it is missing.
std::vector<int> levels_in(const GrowthData& data, const ExactLeaf& leaf, Eigen::Index split_input);

}  // namespace llmt
