#include "data/dataset.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/parallel.hpp"
#include "data/regressors.hpp"
#include "model/evaluator.hpp"
#include "model/through_regressors.hpp"

namespace llmt {
namespace {

// Levels that get a regressor: all that occur but the most frequent one, which is the reference; ascending.
std::vector<int> level_regressors(const Eigen::Ref<const Eigen::VectorXd>& values, int num_levels) {
  std::vector<Eigen::Index> count(num_levels, 0);
  for (const double value : values) {
    if (!std::isnan(value)) {
      ++count[static_cast<std::size_t>(value)];
    }
  }
  std::vector<int> levels(count.size());
  std::iota(levels.begin(), levels.end(), 0);
  std::ranges::stable_sort(levels, [&](int a, int b) { return count[a] > count[b]; });
  std::erase_if(levels, [&](int level) { return count[level] == 0; });
  if (!levels.empty()) {
    levels.erase(levels.begin());
  }
  levels.resize(std::min<std::size_t>(levels.size(), max_level_regressors));
  std::ranges::sort(levels);
  return levels;
}

InputColumn describe_input(const TrainingRows& training, Eigen::Index position) {
  InputColumn column;
  column.name = fmt::format("x{}", position + 1);
  for (int level = 0; level < training.table->num_levels[position]; ++level) {
    column.levels.push_back(fmt::format("{}", level));
  }
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  double sum = 0.0;
  double present = 0.0;
  for (const int row : training.rows) {
    const double value = training.table->inputs(row, position);
    if (!std::isnan(value)) {
      low = std::min(low, value);
      high = std::max(high, value);
      sum += training.table->weights(row) * value;
      present += training.table->weights(row);
    }
  }
  if (present > 0.0) {
    column.low = low;
    column.high = high;
    column.centre = std::clamp(sum / present, low, high);
  }
  return column;
}

OutputColumn describe_output(const TrainingRows& training, Eigen::Index position) {
  OutputColumn column{.name = training.table->outputs.cols() == 1 ? "y" : fmt::format("y{}", position + 1),
                      .low = std::numeric_limits<double>::infinity(),
                      .high = -std::numeric_limits<double>::infinity()};
  for (const int row : training.rows) {
    column.low = std::min(column.low, training.table->outputs(row, position));
    column.high = std::max(column.high, training.table->outputs(row, position));
  }
  return column;
}

// The part of the rows with a value of `input` that have this level.
double share_of_level(const TrainingRows& training, int input, int level) {
  double present = 0.0;
  double here = 0.0;
  for (const int row : training.rows) {
    const double value = training.table->inputs(row, input);
    present += std::isnan(value) ? 0.0 : training.table->weights(row);
    here += value == static_cast<double>(level) ? training.table->weights(row) : 0.0;
  }
  return present > 0.0 ? here / present : 0.0;
}

// The two smallest, or with `sign` -1 largest, of the values seen.
struct Extremes {
  double sign = 1.0;
  double first = std::numeric_limits<double>::infinity();  // sign * value
  double second = std::numeric_limits<double>::infinity();

  void add(double value) {
    const double signed_value = sign * value;
    second = std::min(second, std::max(first, signed_value));
    first = std::min(first, signed_value);
  }
};

// What the rows tell of a regressor.
struct RegressorRange {
  bool has_missing = false;
  double scale = 1.0;
  double low = 0.0;  // without the one row at either end
  double high = 0.0;
};

RegressorRange describe_regressor(const TrainingRows& training, const Regressor& regressor) {
  const Table& table = *training.table;
  const InputColumn& column = training.columns[regressor.input];
  const bool is_level = regressor.level >= 0;
  const InputColumn* second = is_product(regressor) ? &training.columns[regressor.second_input] : nullptr;
  // Squares are taken of parts of the largest deviation: those of the deviations may be too large, or too small.
  const auto farthest = [](const InputColumn& input, double centre) {
    return std::max({input.high - centre, centre - input.low, 0.0});
  };
  const double largest = is_level            ? 1.0
                         : second != nullptr ? farthest(column, column.centre) * farthest(*second, second->centre) +
                                                   std::abs(regressor.centre)
                                             : farthest(column, regressor.centre);
  double squares = 0.0;
  Extremes low{1.0};
  Extremes high{-1.0};
  Eigen::Index present = 0;
  RegressorRange range;
  for (const int row : training.rows) {
    double x = table.inputs(row, regressor.input);
    if (second != nullptr) {
      x = (x - column.centre) * (table.inputs(row, regressor.second_input) - second->centre);
    }
    if (std::isnan(x)) {
      range.has_missing = true;
      continue;
    }
    const double deviation =
        (is_level ? (x == static_cast<double>(regressor.level) ? 1.0 : 0.0) : x) - regressor.centre;
    const double part = largest > 0.0 ? deviation / largest : 0.0;
    squares += training.weight_unit * table.weights(row) * part * part;
    low.add(deviation);
    high.add(deviation);
    ++present;
  }
  if (squares > 0.0) {
    range.scale = largest * std::sqrt(squares / static_cast<double>(training.count()));
  }
  if (present > 0) {
    const bool skip = !is_level && present > 4;
    range.low = skip ? low.second : low.first;
    range.high = -(skip ? high.second : high.first);
  }
  return range;
}

}  // namespace

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

TrainingRows training_rows(const Table& table, std::vector<int> rows, int max_threads) {
  TrainingRows training;
  training.table = &table;
  training.rows = std::move(rows);
  training.weight_unit = static_cast<double>(training.count()) / total_weight(training);
  training.columns.resize(table.inputs.cols());
  parallel_for(table.inputs.cols(), max_threads,
               [&](Eigen::Index j) { training.columns[j] = describe_input(training, j); });
  for (Eigen::Index o = 0; o < table.outputs.cols(); ++o) {
    training.output_columns.push_back(describe_output(training, o));
  }
  for (const int input : table.regression_inputs) {
    const int num_levels = table.num_levels[input];
    if (num_levels == 0) {
      training.regressors.push_back({input, -1, training.columns[input].centre});
      continue;
    }
    // From all rows of the table, so that the folds agree.
    for (const int level : level_regressors(table.inputs.col(input), num_levels)) {
      training.regressors.push_back({input, level, share_of_level(training, input, level)});
    }
  }
  training.split_inputs = table.split_inputs;
  const std::size_t first_product = training.regressors.size();
  training.regressors.resize(first_product + table.products.size());
  parallel_for(std::ssize(table.products), max_threads, [&](Eigen::Index k) {
    const std::size_t slot = k;
    training.regressors[first_product + slot] =
        product_regressor(table, training.rows, training.columns, table.products[slot]);
  });
  const Eigen::Index regressors = std::ssize(training.regressors);
  std::vector<RegressorRange> ranges(training.regressors.size());
  parallel_for(regressors, max_threads, [&](Eigen::Index k) {
    const std::size_t slot = k;
    ranges[slot] = describe_regressor(training, training.regressors[slot]);
  });
  training.scale.resize(regressors);
  training.spread.resize(2, regressors);
  for (Eigen::Index k = 0; k < regressors; ++k) {
    const RegressorRange& range = ranges[k];
    training.has_missing = training.has_missing || range.has_missing;
    training.scale(k) = range.scale;
    training.spread.col(k) << range.low, range.high;
  }
  return training;
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
  double sum = 0.0;
  for (const int row : rows.rows) {
    sum += rows.table->weights(row);
  }
  return rows.weight_unit * sum;
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

Chunk fetch(const TrainingRows& rows, Eigen::Index index, const std::vector<int>& outputs) {
  std::vector<int> positions(std::min(chunk_rows, rows.count() - index * chunk_rows));
  std::iota(positions.begin(), positions.end(), static_cast<int>(index * chunk_rows));
  return fetch(rows, positions, outputs);
}

void for_each_chunk(const TrainingRows& rows, const std::vector<int>& outputs, int max_threads,
                    const std::function<void(std::size_t, const Chunk&)>& body) {
  parallel_for(std::min(num_slots, num_chunks(rows)), max_threads, [&](Eigen::Index slot) {
    for (Eigen::Index index = slot; index < num_chunks(rows); index += num_slots) {
      body(slot, fetch(rows, index, outputs));
    }
  });
}

}  // namespace llmt
