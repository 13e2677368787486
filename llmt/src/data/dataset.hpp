/// \file
/// The rows that a model is made from, in the forms its parts need.
#pragma once

#include <Eigen/Core>
#include <span>
#include <utility>
#include <vector>

#include "base/matrix.hpp"
#include "base/sum_over.hpp"
#include "data/table.hpp"
#include "llmt/partition.hpp"

namespace llmt {

/// Some rows of a table with what a model says of the columns. Also used for rows that are held out, then with the
/// columns of the training rows.
struct TrainingRows {
  const Table* table = nullptr;
  std::vector<int> rows;  ///< of the table, ascending
  std::vector<InputColumn> columns;
  std::vector<OutputColumn> output_columns;
  std::vector<Regressor> regressors;
  std::vector<int> split_inputs;  ///< that growth may split, ascending
  double weight_unit = 1.0;       ///< times the table's weight is a row's weight; in training these have mean 1
  bool has_missing = false;       ///< whether a regressor is missing in some row
  Eigen::VectorXd scale;          ///< root mean square of each regressor's deviations; 1 where it is 0
  Eigen::MatrixXd spread;         ///< 2 x regressors: smallest and largest deviation but for the one row at either end

  Eigen::Index count() const { return std::ssize(rows); }
  Eigen::VectorXd low() const;  ///< extent of the inputs
  Eigen::VectorXd high() const;
};

/// The given rows, columns described from them. `table` must live as long as the result.
TrainingRows training_rows(const Table& table, std::vector<int> rows, int max_threads = 1);

/// The same rows of a table with other weights, under the same columns.
TrainingRows with_table(const TrainingRows& rows, const Table& table);

/// The same rows, of which only the given inputs (ascending) may be split and have regressors.
TrainingRows narrowed(const TrainingRows& rows, const std::vector<int>& inputs);

/// The given rows under the columns of `training`.
TrainingRows query_rows(const Table& table, std::vector<int> rows, const TrainingRows& training);

/// A few rows laid out one after the other, for passes over all of them: usually those of a block.
struct Chunk {
  RowMajor inputs;      ///< NaN: missing
  RowMajor deviations;  ///< of the regressors from their centres; NaN: missing
  RowMajor outputs;     ///< the ones asked for
  Eigen::VectorXd weights;

  Eigen::Index count() const { return weights.size(); }
};

/// Number of blocks of block_rows rows.
inline Eigen::Index num_chunks(const TrainingRows& rows) { return RowBlocks{rows.count()}.count(); }

/// Sum of the rows' weights.
double total_weight(const TrainingRows& rows);

/// The rows of a block.
Chunk fetch(const TrainingRows& rows, Eigen::Index block, const std::vector<int>& outputs);

/// The rows of all blocks.
std::vector<Chunk> fetch_all(const TrainingRows& rows, const std::vector<int>& outputs);

/// Inputs of some rows, given by their positions among `rows`; NaN: missing.
RowMajor inputs_of(const TrainingRows& rows, std::span<const int> positions);

/// The rows at the given positions of `rows`.
Chunk fetch(const TrainingRows& rows, const std::vector<int>& positions, const std::vector<int>& outputs);

/// sum_over() with the rows laid out: add(chunk, sum).
template <class Sum, class Add>
Sum sum_over(const TrainingRows& rows, const std::vector<int>& outputs, int max_threads, Sum zero, const Add& add) {
  return sum_over(RowBlocks{rows.count()}, max_threads, std::move(zero),
                  [&](RowSpan block, Sum& sum) { add(fetch(rows, block.begin / block_rows, outputs), sum); });
}

/// Positions of the `count` rows (all, if they are fewer) with the smallest hashes of their inputs and outputs,
/// ascending; and of the rows that equal one of them. Which rows they are does not depend on the order of the rows, and
/// fewer are among more.
std::vector<int> smallest_hashes(const TrainingRows& rows, Eigen::Index count, int max_threads);

/// The `count` rows with the smallest hashes, or all if they are few more, with weights that make them stand for all.
TrainingRows subsample(const TrainingRows& rows, Eigen::Index count, int max_threads = 1);

/// Levels beyond this many, the rarest, share the reference level's place in the local models.
inline constexpr Eigen::Index max_level_regressors = 30;

}  // namespace llmt
