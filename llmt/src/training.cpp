#include "training.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "evaluator.hpp"

namespace llmt {
namespace {

/// Levels that get a regressor: all that occur but the most frequent one, which is the reference; ascending.
std::vector<int> level_regressors(const Eigen::VectorXd& values, int num_levels) {
  std::vector<std::ptrdiff_t> count(static_cast<std::size_t>(num_levels), 0);
  for (const double value : values) {
    if (!std::isnan(value)) {
      ++count[static_cast<std::size_t>(value)];
    }
  }
  std::vector<int> levels(count.size());
  std::iota(levels.begin(), levels.end(), 0);
  std::stable_sort(levels.begin(), levels.end(), [&](int a, int b) {
    return count[static_cast<std::size_t>(a)] > count[static_cast<std::size_t>(b)];
  });
  std::erase_if(levels, [&](int level) { return count[static_cast<std::size_t>(level)] == 0; });
  if (!levels.empty()) {
    levels.erase(levels.begin());
  }
  levels.resize(std::min<std::size_t>(levels.size(), max_level_regressors));
  std::sort(levels.begin(), levels.end());
  return levels;
}

InputColumn describe_input(const Eigen::VectorXd& values, const Eigen::VectorXd& weights, std::ptrdiff_t position,
                           int num_levels) {
  InputColumn column;
  column.name = fmt::format("x{}", position + 1);
  for (int level = 0; level < num_levels; ++level) {
    column.levels.push_back(fmt::format("{}", level));
  }
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  double sum = 0.0;
  double present = 0.0;
  for (std::ptrdiff_t i = 0; i < values.size(); ++i) {
    if (!std::isnan(values(i))) {
      low = std::min(low, values(i));
      high = std::max(high, values(i));
      sum += weights(i) * values(i);
      present += weights(i);
    }
  }
  if (present > 0.0) {
    column.low = low;
    column.high = high;
    column.centre = std::clamp(sum / present, low, high);
  }
  return column;
}

void fill_deviations(TrainingRows& rows) {
  rows.deviations.resize(rows.inputs.rows(), std::ssize(rows.regressors));
  for (std::ptrdiff_t i = 0; i < rows.inputs.rows(); ++i) {
    deviations_at(rows.columns, rows.regressors, rows.inputs.row(i).data(), rows.deviations.row(i).data());
  }
}

TrainingRows take(const Table& table, const std::vector<std::ptrdiff_t>& rows) {
  TrainingRows taken;
  taken.inputs = table.inputs(rows, Eigen::all);
  taken.outputs = table.outputs(rows, Eigen::all);
  taken.weights = table.weights(rows);
  return taken;
}

}  // namespace

Eigen::VectorXd TrainingRows::low() const {
  Eigen::VectorXd result(std::ssize(columns));
  std::transform(columns.begin(), columns.end(), result.begin(), [](const InputColumn& column) { return column.low; });
  return result;
}

Eigen::VectorXd TrainingRows::high() const {
  Eigen::VectorXd result(std::ssize(columns));
  std::transform(columns.begin(), columns.end(), result.begin(), [](const InputColumn& column) { return column.high; });
  return result;
}

TrainingRows training_rows(const Table& table, const std::vector<std::ptrdiff_t>& rows) {
  TrainingRows training = take(table, rows);
  training.weights *= static_cast<double>(training.weights.size()) / training.weights.sum();
  for (std::ptrdiff_t j = 0; j < training.inputs.cols(); ++j) {
    training.columns.push_back(
        describe_input(training.inputs.col(j), training.weights, j, table.num_levels[static_cast<std::size_t>(j)]));
  }
  for (std::ptrdiff_t o = 0; o < training.outputs.cols(); ++o) {
    training.output_columns.push_back({.name = training.outputs.cols() == 1 ? "y" : fmt::format("y{}", o + 1),
                                       .low = training.outputs.col(o).minCoeff(),
                                       .high = training.outputs.col(o).maxCoeff()});
  }
  for (const int input : table.regression_inputs) {
    const int num_levels = table.num_levels[static_cast<std::size_t>(input)];
    if (num_levels == 0) {
      training.regressors.push_back({input, -1, training.columns[static_cast<std::size_t>(input)].centre});
      continue;
    }
    const Eigen::VectorXd values = training.inputs.col(input);
    // From all rows of the table, so that the folds agree.
    for (const int level : level_regressors(table.inputs.col(input), num_levels)) {
      const double present = values.array().isNaN().select(0.0, training.weights).sum();
      const double here = (values.array() == static_cast<double>(level)).select(training.weights, 0.0).sum();
      training.regressors.push_back({input, level, present > 0.0 ? here / present : 0.0});
    }
  }
  fill_deviations(training);
  return training;
}

TrainingRows query_rows(const Table& table, const std::vector<std::ptrdiff_t>& rows, const TrainingRows& training) {
  TrainingRows query = take(table, rows);
  query.columns = training.columns;
  query.output_columns = training.output_columns;
  query.regressors = training.regressors;
  fill_deviations(query);
  return query;
}

}  // namespace llmt
