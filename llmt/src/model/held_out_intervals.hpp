/// \file
/// Prediction intervals from the rows that folds held out.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "llmt/intervals.hpp"

namespace llmt {

/// Rows of a fit, some of which folds hold out.
struct MeasuredRows {
  Eigen::Ref<const Eigen::MatrixXd> inputs;
  Eigen::Ref<const Eigen::MatrixXd> outputs;
  const Eigen::VectorXd& precisions;           ///< weights; empty: none
  std::vector<int> copies;                     ///< how often each row counts
  std::vector<std::span<const int>> held_out;  ///< by each fold
  Eigen::Index size_limit = 0;                 ///< TrainingRecord::size_limit
};

/// The intervals of the folds' models with the absolute residuals of the rows that each fold held out, and the record
/// of the rows for `of_all`, the model of all rows.
Intervals held_out_intervals(std::vector<Model> models, const Model& of_all, const MeasuredRows& rows, int max_threads);

}  // namespace llmt
