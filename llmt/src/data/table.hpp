/// \file
/// The caller's data, checked.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

namespace llmt {

/// The data of a fit: the caller's own, nothing is copied.
struct Table {
  Eigen::Ref<const Eigen::MatrixXd> inputs;  ///< NaN: missing
  Eigen::Ref<const Eigen::MatrixXd> outputs;
  Eigen::VectorXd weights;             ///< positive
  std::vector<int> num_levels;         ///< of each input; 0: a number
  std::vector<int> regression_inputs;  ///< ascending
  std::vector<int> split_inputs;       ///< ascending
  /// Pairs of regression inputs whose products the local models use.
  std::vector<std::pair<int, int>> products = {};
  std::vector<int> slope_signs = {};  ///< of each input, those of `monotone` included; empty: none
  std::vector<int> monotone = {};     ///< see FitOptions; empty: none
};

}  // namespace llmt
