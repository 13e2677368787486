#include "data/dataset.hpp"

#include <algorithm>
#include <numeric>

#include "partition/evaluator.hpp"
#include "partition/through_regressors.hpp"

namespace llmt {
Eigen::VectorXd TrainingRows::low() const {
  Eigen::VectorXd result(std::ssize(columns));
  std::ranges::transform(columns, result.begin(), [](const InputColumn& column) { return column.low; });
  return result;
}

Eigen::VectorXd TrainingRows::high() const {
  Eigen::VectorXd result(std::ssize(columns));
  std::ranges::transform(columns, result.begin(), [](const InputColumn& column) { return column.high; });
  return result;
}

TrainingRows query_rows(const Table& table, std::vector<int> rows, const TrainingRows& training) {
  TrainingRows query;
  query.table = &table;
  query.rows = std::move(rows);
  query.columns = training.columns;
  query.output_columns = training.output_columns;
  query.regressors = training.regressors;
  query.split_inputs = training.split_inputs;
  return query;
}

TrainingRows with_table(const TrainingRows& rows, const Table& table) {
  TrainingRows result = rows;
  result.table = &table;
  result.weight_unit = 1.0;
  result.weight_unit = static_cast<double>(result.count()) / total_weight(result);
  return result;
}

double total_weight(const TrainingRows& rows) {
  return rows.weight_unit *
         sum_of_rows(rows.count(), [&](Eigen::Index i) { return rows.table->weights(rows.rows[i]); });
}

Chunk fetch(const TrainingRows& rows, const std::vector<int>& positions, const std::vector<int>& outputs) {
  const Eigen::Index count = std::ssize(positions);
  const Table& table = *rows.table;
  const auto row_at = [&](Eigen::Index i) { return rows.rows[positions[i]]; };
  Chunk chunk{RowMajor(count, table.inputs.cols()), RowMajor(count, std::ssize(rows.regressors)),
              RowMajor(count, std::ssize(outputs)), Eigen::VectorXd(count)};
  for (Eigen::Index j = 0; j < table.inputs.cols(); ++j) {
    for (Eigen::Index i = 0; i < count; ++i) {
      chunk.inputs(i, j) = table.inputs(row_at(i), j);
    }
  }
  for (Eigen::Index o = 0; o < std::ssize(outputs); ++o) {
    for (Eigen::Index i = 0; i < count; ++i) {
      chunk.outputs(i, o) = table.outputs(row_at(i), outputs[o]);
    }
  }
  for (Eigen::Index i = 0; i < count; ++i) {
    chunk.weights(i) = rows.weight_unit * table.weights(row_at(i));
    deviations_at(rows.columns, rows.regressors, chunk.inputs.row(i).data(), chunk.deviations.row(i).data());
  }
  return chunk;
}

RowMajor inputs_of(const TrainingRows& rows, std::span<const int> positions) {
  const Eigen::Ref<const Eigen::MatrixXd>& inputs = rows.table->inputs;
  RowMajor result(std::ssize(positions), inputs.cols());
  for (Eigen::Index i = 0; i < result.rows(); ++i) {
    const int row = rows.rows[positions[i]];
    for (Eigen::Index j = 0; j < result.cols(); ++j) {
      result(i, j) = inputs(row, j);
    }
  }
  return result;
}

Chunk fetch(const TrainingRows& rows, Eigen::Index block, const std::vector<int>& outputs) {
  const RowSpan span = RowBlocks{rows.count()}[block];
  std::vector<int> positions(span.count());
  std::iota(positions.begin(), positions.end(), static_cast<int>(span.begin));
  return fetch(rows, positions, outputs);
}

std::vector<Chunk> fetch_all(const TrainingRows& rows, const std::vector<int>& outputs) {
  std::vector<Chunk> chunks;
  for (Eigen::Index block = 0; block < num_chunks(rows); ++block) chunks.push_back(fetch(rows, block, outputs));
  return chunks;
}

}  // namespace llmt
