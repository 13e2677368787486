/// \file
/// The rows that a model is made from, in the forms its parts need.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/fit.hpp"
#include "node_fit.hpp"

namespace llmt {

/// Rows with what a model says of their columns. Also used for rows that are held out, then with the columns of the
/// training rows.
struct TrainingRows {
  std::vector<InputColumn> columns;
  std::vector<OutputColumn> output_columns;
  std::vector<Regressor> regressors;
  RowMajor inputs;          ///< NaN: missing
  RowMajor deviations;      ///< of the regressors from their centres; NaN: missing
  Eigen::MatrixXd outputs;  ///< all outputs
  Eigen::VectorXd weights;  ///< positive, with mean 1

  std::ptrdiff_t count() const { return inputs.rows(); }
  Eigen::VectorXd low() const;  ///< extent of the inputs
  Eigen::VectorXd high() const;
};

/// What all rows of a fit have in common, whatever the fold.
struct Table {
  Eigen::MatrixXd inputs;
  Eigen::MatrixXd outputs;
  Eigen::VectorXd weights;             ///< positive
  std::vector<int> num_levels;         ///< of each input; 0: a number
  std::vector<int> regression_inputs;  ///< ascending
  std::vector<int> split_inputs;       ///< ascending
};

/// The given rows, columns described from them.
TrainingRows training_rows(const Table& table, const std::vector<std::ptrdiff_t>& rows);

/// The given rows under the columns of `training`.
TrainingRows query_rows(const Table& table, const std::vector<std::ptrdiff_t>& rows, const TrainingRows& training);

/// Levels beyond this many, the rarest, share the reference level's place in the local models.
inline constexpr std::ptrdiff_t max_level_regressors = 30;

}  // namespace llmt
