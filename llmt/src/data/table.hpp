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

/// The caller's data. Rows of weight 0 take no part. Where rows are held out, copies of a row (find_equal_rows()) only
/// add to its weight, and repeats of a measurement share a fold. Nothing is copied where all rows take part.
class FitData {
 public:
  /// Throws std::invalid_argument as fit(). No columns named means all of them. `orders_splits`: the growth rule can
  /// split on inputs in which the prediction is to be monotone; else these are not split.
  FitData(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
          const FitOptions& options, bool orders_splits);
  FitData(const FitData&) = delete;
  FitData& operator=(const FitData&) = delete;

  const Table& table() const { return *table_; }
  /// The table with the weights that its rows have in training: times `loss_weights`, one for each row of the caller
  /// and equal for copies. Empty: all 1.
  Table trained(const Eigen::VectorXd& loss_weights) const;
  /// FitOptions::folds with the groups of the table's rows.
  const FoldOptions& folds() const { return folds_; }
  /// Of each row of the caller, the row of the table that it is; -1: it takes no part.
  const std::vector<int>& row_of() const { return row_of_; }
  /// The number of the caller's rows that are copies.
  Eigen::Index copies() const { return copies_; }
  /// Whether rows with equal inputs are repeats.
  bool has_repeats() const { return has_repeats_; }

 private:
  void leave_out_copies(const std::vector<int>& copy_of, std::vector<Eigen::Index>& rows, Eigen::VectorXd& weights);

  std::vector<int> row_of_;
  Eigen::Index copies_ = 0;
  bool has_repeats_ = false;
  Eigen::MatrixXd inputs_;
  Eigen::MatrixXd outputs_;
  std::vector<double> groups_;
  FoldOptions folds_;
  std::optional<Table> table_;
};

}  // namespace llmt
