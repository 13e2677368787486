/// \file
/// Data by column.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

namespace llmt {

/// Data by column and what is known of the columns. The inputs and outputs must outlive the table.
struct Table {
  Eigen::Ref<const Eigen::MatrixXd> inputs;  ///< NaN: missing
  Eigen::Ref<const Eigen::MatrixXd> outputs;
  Eigen::VectorXd weights;             ///< positive
  std::vector<int> num_levels;         ///< of each input; 0: a number
  std::vector<int> regression_inputs;  ///< ascending
  std::vector<int> split_inputs;       ///< ascending
  /// Pairs of regression inputs whose products the local models use.
  std::vector<std::pair<int, int>> products = {};
  std::vector<int> slope_signs = {};  ///< of each input, see Trend; those of `monotone` included; empty: none
  std::vector<int> monotone = {};     ///< of each input, the sign of a monotone trend; empty: none
};

}  // namespace llmt
