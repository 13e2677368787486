/// \file
/// The data of a fit: checked, without the rows of weight 0.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <utility>
#include <vector>

#include "llmt/options.hpp"

namespace llmt {

/// Data by column and what is known of the columns. Inputs and outputs belong to the caller or to FitData.
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

/// The caller's data. Nothing is copied unless there are rows of weight 0: then what takes part is.
class FitData {
 public:
  /// Throws std::invalid_argument as fit(). No columns named means all of them. `orders_splits`: the growth rule can
  /// split on inputs in which the prediction is to be monotone; else these are not split.
  FitData(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
          const FitOptions& options, bool orders_splits);
  FitData(const FitData&) = delete;
  FitData& operator=(const FitData&) = delete;

  const Table& table() const { return *table_; }
  /// FitOptions::folds with the groups of the rows that take part.
  const FoldOptions& folds() const { return folds_; }
  /// The caller's rows that take part, ascending.
  const std::vector<Eigen::Index>& rows() const { return rows_; }

 private:
  std::vector<Eigen::Index> rows_;
  Eigen::MatrixXd inputs_;
  Eigen::MatrixXd outputs_;
  std::vector<double> groups_;
  FoldOptions folds_;
  std::optional<Table> table_;
};

}  // namespace llmt
