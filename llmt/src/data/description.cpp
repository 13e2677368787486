// Columns and regressors as the training rows describe them: range, mean, scale and levels.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>

#include "data/dataset.hpp"
#include "partition/through_regressors.hpp"

namespace llmt {
namespace {

struct ColumnSums {
  std::vector<Extent> inputs;
  std::vector<Extent> outputs;
  std::vector<WeightedMean> means;          // of the inputs, over the rows that have a value
  std::vector<std::vector<double>> levels;  // weight of each level of an input

  static auto fields(auto& self) { return std::tie(self.inputs, self.outputs, self.means, self.levels); }
};

void add_input(const TrainingRows& training, RowSpan block, Eigen::Index input, ColumnSums& sums) {
  const Table& table = *training.table;
  Extent extent;
  WeightedMean mean = sums.means[input];
  std::vector<double>& levels = sums.levels[input];
  for (Eigen::Index i = block.begin; i < block.end; ++i) {
    const int row = training.rows[i];
    const double value = table.inputs(row, input);
    if (std::isnan(value)) continue;
    const double weight = table.weights(row);
    extent.widen(value);
    mean.add(value, weight);
    if (!levels.empty()) levels[static_cast<std::size_t>(value)] += weight;
  }
  sums.inputs[input] += extent;
  sums.means[input] = mean;
}

ColumnSums sum_columns(const TrainingRows& training, int max_threads) {
  const Table& table = *training.table;
  const std::size_t inputs = table.inputs.cols();
  ColumnSums zero;
  zero.inputs.resize(inputs);
  zero.means.resize(inputs);
  zero.outputs.resize(table.outputs.cols());
  for (const int levels : table.num_levels) zero.levels.emplace_back(levels, 0.0);
  const auto add = [&](RowSpan block, ColumnSums& sums) {
    for (Eigen::Index j = 0; j < table.inputs.cols(); ++j) add_input(training, block, j, sums);
    for (Eigen::Index o = 0; o < table.outputs.cols(); ++o) {
      for (Eigen::Index i = block.begin; i < block.end; ++i) {
        sums.outputs[o].widen(table.outputs(training.rows[i], o));
      }
    }
  };
  return sum_over(RowBlocks{training.count()}, max_threads, std::move(zero), add);
}

InputColumn describe_input(Eigen::Index position, int num_levels, const ColumnSums& sums) {
  InputColumn column;
  column.name = fmt::format("x{}", position + 1);
  for (int level = 0; level < num_levels; ++level) column.levels.push_back(fmt::format("{}", level));
  const WeightedMean& mean = sums.means[position];
  if (mean.weight > 0.0) {
    column.low = sums.inputs[position].low;
    column.high = sums.inputs[position].high;
    column.centre = std::clamp(mean.value(), column.low, column.high);
  }
  return column;
}

// Levels that get a regressor: all that occur but the most frequent one, which is the reference; ascending. They are
// those of all rows of the table, so that the folds agree.
std::vector<int> level_regressors(const Table& table, int input, int max_threads) {
  using Counts = std::vector<Eigen::Index>;
  const auto add = [&](RowSpan block, Counts& counts) {
    for (Eigen::Index row = block.begin; row < block.end; ++row) {
      const double value = table.inputs(row, input);
      if (!std::isnan(value)) ++counts[static_cast<std::size_t>(value)];
    }
  };
  const Counts count = sum_over(RowBlocks{table.inputs.rows()}, max_threads, Counts(table.num_levels[input], 0), add);
  std::vector<int> levels(count.size());
  std::iota(levels.begin(), levels.end(), 0);
  std::ranges::stable_sort(levels, [&](int a, int b) { return count[a] > count[b]; });
  std::erase_if(levels, [&](int level) { return count[level] == 0; });
  if (!levels.empty()) levels.erase(levels.begin());
  levels.resize(std::min<std::size_t>(levels.size(), max_level_regressors));
  std::ranges::sort(levels);
  return levels;
}

// Adds the products of the deviations of two inputs, where both have a value. No row lies beyond their extent.
void add_product(const TrainingRows& training, RowSpan block, const std::pair<int, int>& inputs, WeightedMean& sum) {
  const Table& table = *training.table;
  const auto [first, second] = inputs;
  const double first_centre = training.columns[first].centre;
  const double second_centre = training.columns[second].centre;
  WeightedMean mean = sum;
  for (Eigen::Index i = block.begin; i < block.end; ++i) {
    const int row = training.rows[i];
    const double product = (table.inputs(row, first) - first_centre) * (table.inputs(row, second) - second_centre);
    if (!std::isnan(product)) mean.add(product, table.weights(row));
  }
  sum = mean;
}

// The products of the deviations of two inputs, about their weighted means.
std::vector<Regressor> product_regressors(const TrainingRows& training, int max_threads) {
  const std::vector<std::pair<int, int>>& products = training.table->products;
  using Means = std::vector<WeightedMean>;
  const auto add = [&](RowSpan block, Means& sums) {
    for (std::size_t k = 0; k < products.size(); ++k) add_product(training, block, products[k], sums[k]);
  };
  const Means means = sum_over(RowBlocks{training.count()}, max_threads, Means(products.size()), add);
  std::vector<Regressor> regressors;
  for (std::size_t k = 0; k < products.size(); ++k) {
    const auto [first, second] = products[k];
    regressors.push_back({.input = first, .level = -1, .centre = means[k].value(), .second_input = second});
  }
  return regressors;
}

// The two smallest of the values seen.
struct Smallest {
  double first = std::numeric_limits<double>::infinity();
  double second = std::numeric_limits<double>::infinity();

  void add(double value) {
    second = std::min(second, std::max(first, value));
    first = std::min(first, value);
  }
  Smallest& operator+=(const Smallest& other) {
    add(other.first);
    add(other.second);
    return *this;
  }
};

struct RegressorSums {
  double squares = 0.0;  // of the deviations as parts of the largest
  Smallest low;
  Smallest high;  // of the negative values
  Eigen::Index present = 0;

  static auto fields(auto& self) { return std::tie(self.squares, self.low, self.high, self.present); }
};

// The largest deviation that a regressor can have. Squares are taken of parts of it: those of the deviations may be too
// large, or too small.
double largest_deviation(const TrainingRows& training, const Regressor& regressor) {
  const auto farthest = [](const InputColumn& input, double centre) {
    return std::max({input.high - centre, centre - input.low, 0.0});
  };
  const InputColumn& column = training.columns[regressor.input];
  if (regressor.level >= 0) return 1.0;
  if (!is_product(regressor)) return farthest(column, regressor.centre);
  const InputColumn& second = training.columns[regressor.second_input];
  return farthest(column, column.centre) * farthest(second, second.centre) + std::abs(regressor.centre);
}

void add_regressor(const TrainingRows& training, RowSpan block, const Regressor& regressor, RegressorSums& all) {
  const Table& table = *training.table;
  const InputColumn& column = training.columns[regressor.input];
  const bool is_level = regressor.level >= 0;
  const InputColumn* second = is_product(regressor) ? &training.columns[regressor.second_input] : nullptr;
  const double largest = largest_deviation(training, regressor);
  RegressorSums sums = all;
  for (Eigen::Index i = block.begin; i < block.end; ++i) {
    const int row = training.rows[i];
    double x = table.inputs(row, regressor.input);
    if (second != nullptr) {
      x = (x - column.centre) * (table.inputs(row, regressor.second_input) - second->centre);
    }
    if (std::isnan(x)) continue;
    const double deviation =
        (is_level ? (x == static_cast<double>(regressor.level) ? 1.0 : 0.0) : x) - regressor.centre;
    const double part = largest > 0.0 ? deviation / largest : 0.0;
    sums.squares += training.weight_unit * table.weights(row) * part * part;
    sums.low.add(deviation);
    sums.high.add(-deviation);
    ++sums.present;
  }
  all = sums;
}

// Sets what the rows tell of the regressors.
void describe_regressors(TrainingRows& training, int max_threads) {
  const Eigen::Index regressors = std::ssize(training.regressors);
  using Sums = std::vector<RegressorSums>;
  const auto add = [&](RowSpan block, Sums& all) {
    for (Eigen::Index k = 0; k < regressors; ++k) add_regressor(training, block, training.regressors[k], all[k]);
  };
  const Sums sums = sum_over(RowBlocks{training.count()}, max_threads, Sums(regressors), add);
  training.scale.setOnes(regressors);
  training.spread.setZero(2, regressors);
  for (Eigen::Index k = 0; k < regressors; ++k) {
    const auto& [squares, low, high, present] = sums[k];
    training.has_missing = training.has_missing || present < training.count();
    if (squares > 0.0) {
      training.scale(k) = largest_deviation(training, training.regressors[k]) *
                          std::sqrt(squares / static_cast<double>(training.count()));
    }
    if (present > 0) {
      const bool skip = training.regressors[k].level < 0 && present > 4;
      training.spread.col(k) << (skip ? low.second : low.first), -(skip ? high.second : high.first);
    }
  }
}

}  // namespace

TrainingRows training_rows(const Table& table, std::vector<int> rows, int max_threads) {
  TrainingRows training;
  training.table = &table;
  training.rows = std::move(rows);
  training.weight_unit = static_cast<double>(training.count()) / total_weight(training);
  const ColumnSums sums = sum_columns(training, max_threads);
  for (Eigen::Index j = 0; j < table.inputs.cols(); ++j) {
    training.columns.push_back(describe_input(j, table.num_levels[j], sums));
  }
  for (Eigen::Index o = 0; o < table.outputs.cols(); ++o) {
    training.output_columns.push_back({.name = table.outputs.cols() == 1 ? "y" : fmt::format("y{}", o + 1),
                                       .low = sums.outputs[o].low,
                                       .high = sums.outputs[o].high});
  }
  for (const int input : table.regression_inputs) {
    if (table.num_levels[input] == 0) {
      training.regressors.push_back({input, -1, training.columns[input].centre});
      continue;
    }
    for (const int level : level_regressors(table, input, max_threads)) {
      const WeightedMean share{sums.levels[input][level], sums.means[input].weight};
      training.regressors.push_back({input, level, share.value()});
    }
  }
  training.split_inputs = table.split_inputs;
  std::ranges::move(product_regressors(training, max_threads), std::back_inserter(training.regressors));
  describe_regressors(training, max_threads);
  return training;
}

}  // namespace llmt
