#include "data/table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "base/checks.hpp"
#include "base/count.hpp"
#include "data/equal_rows.hpp"
#include "data/regressors.hpp"

namespace llmt {
namespace {

void require(bool condition, const char* option, double value, const char* bound) {
  if (!condition) {
    throw std::invalid_argument(fmt::format("llmt::fit: {} is {}, it must be {}", option, value, bound));
  }
}

void check_size(const char* name, const Eigen::Ref<const Eigen::MatrixXd>& data) {
  if (data.rows() < 1 || data.cols() < 1) {
    throw std::invalid_argument(fmt::format("llmt::fit: {} is {} x {}, at least one row and one column are needed",
                                            name, data.rows(), data.cols()));
  }
}

double largest_of(const Eigen::Ref<const Eigen::MatrixXd>& values) {
  return values.array().isNaN().select(0.0, values).cwiseAbs().maxCoeff();
}

// Squares must neither overflow nor vanish.
void check_magnitudes(const char* name, const Eigen::Ref<const Eigen::MatrixXd>& values) {
  const double largest = largest_of(values);
  require(largest <= largest_magnitude, fmt::format("a magnitude in {}", name).c_str(), largest, "at most 1e150");
  for (Eigen::Index column = 0; column < values.cols(); ++column) {
    const double of_column = largest_of(values.col(column));
    require(of_column == 0.0 || of_column >= smallest_magnitude,
            fmt::format("the largest magnitude in column {} of {}", column, name).c_str(), of_column,
            "0 or at least 1e-140");
  }
}

void check_outputs(const Eigen::Ref<const Eigen::MatrixXd>& outputs, Eigen::Index rows) {
  check_size("outputs", outputs);
  check_finite("llmt::fit", "outputs", outputs);
  check_magnitudes("outputs", outputs);
  if (rows != outputs.rows()) {
    throw std::invalid_argument(fmt::format("llmt::fit: inputs has {} rows, outputs has {}", rows, outputs.rows()));
  }
  require(rows <= std::numeric_limits<int>::max(), "the number of rows", static_cast<double>(rows), "below 2^31");
}

void check_inputs(const Eigen::Ref<const Eigen::MatrixXd>& inputs) {
  check_size("inputs", inputs);
  check_finite_or_missing("llmt::fit", "inputs", inputs);
  check_magnitudes("inputs", inputs);
}

std::vector<int> all_columns(Eigen::Index count) {
  std::vector<int> columns(count);
  std::iota(columns.begin(), columns.end(), 0);
  return columns;
}

// Number of levels of every input, 0 for numbers.
std::vector<int> count_levels(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const std::vector<int>& categorical) {
  check_columns("llmt::fit", "categorical_inputs", categorical, inputs.cols());
  std::vector<int> num_levels(inputs.cols(), 0);
  for (const int column : categorical) {
    for (const double value : inputs.col(column)) {
      if (std::isnan(value)) continue;
      require(value >= 0.0 && value < most_categories && value == std::floor(value),
              fmt::format("a category of input {}", column).c_str(), value, "a whole number from 0 to 9999");
      int& levels = num_levels[column];
      levels = std::max(levels, static_cast<int>(value) + 1);
    }
    // All missing: a category that never occurs.
    num_levels[column] = std::max(num_levels[column], 1);
  }
  return num_levels;
}

void check_signs(const char* option, const std::vector<int>& signs, const std::vector<int>& num_levels) {
  if (!signs.empty() && signs.size() != num_levels.size()) {
    throw std::invalid_argument(
        fmt::format("llmt::fit: {} has {} entries, there are {} inputs", option, signs.size(), num_levels.size()));
  }
  for (std::size_t j = 0; j < signs.size(); ++j) {
    require(signs[j] >= -1 && signs[j] <= 1, fmt::format("{}[{}]", option, j).c_str(), signs[j], "-1, 0 or 1");
    require(signs[j] == 0 || num_levels[j] == 0, fmt::format("{}[{}]", option, j).c_str(), signs[j],
            "0: the input is categorical, its values have no order");
  }
}

// Signs of slopes and of the prediction, which includes the former.
void set_signs(const FitOptions& options, Table& table) {
  check_signs("slope_signs", options.slope_signs, table.num_levels);
  check_signs("monotone", options.monotone, table.num_levels);
  table.slope_signs = options.slope_signs;
  if (std::ranges::all_of(options.monotone, [](int sign) { return sign == 0; })) return;
  table.monotone = options.monotone;
  table.slope_signs.resize(table.monotone.size(), 0);
  for (std::size_t j = 0; j < table.monotone.size(); ++j) {
    require(table.monotone[j] == 0 || table.slope_signs[j] != -table.monotone[j],
            fmt::format("slope_signs[{}]", j).c_str(), table.slope_signs[j], "not the opposite of monotone");
    table.slope_signs[j] = table.monotone[j] != 0 ? table.monotone[j] : table.slope_signs[j];
  }
}

Eigen::VectorXd scaled_weights(const Eigen::VectorXd& given, Eigen::Index rows) {
  if (given.size() == 0) return Eigen::VectorXd::Ones(rows);
  if (given.size() != rows) {
    throw std::invalid_argument(
        fmt::format("llmt::fit: weights has {} entries, inputs has {} rows", given.size(), rows));
  }
  check_finite("llmt::fit", "weights", given);
  require(given.minCoeff() >= 0.0, "a weight", given.minCoeff(), "at least 0");
  require(given.maxCoeff() > 0.0, "the largest weight", given.maxCoeff(), "positive");
  return given / given.maxCoeff();
}

void check_products(const Table& table) {
  const Eigen::Index numbers = std::ssize(numeric_regression_inputs(table));
  require(numbers <= most_inputs_of_products,
          "the number of numeric regression inputs of quadratic local models (terms)", static_cast<double>(numbers),
          "at most 13; regression_inputs chooses them");
  const double largest = largest_of(table.inputs);
  require(largest <= largest_factor, "a magnitude in inputs, with quadratic local models,", largest, "at most 1e70");
}

Table make_table(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
                 const FitOptions& options, bool orders_splits) {
  check_inputs(inputs);
  check_outputs(outputs, inputs.rows());
  Table table{inputs,
              outputs,
              options.weights,
              count_levels(inputs, options.categorical_inputs),
              options.regression_inputs,
              options.split_inputs};
  table.weights = scaled_weights(options.weights, inputs.rows());
  for (std::vector<int>* columns : {&table.split_inputs, &table.regression_inputs}) {
    if (columns->empty()) {
      *columns = all_columns(inputs.cols());
    }
    std::sort(columns->begin(), columns->end());
  }
  set_signs(options, table);
  if (options.terms == LocalTerms::quadratic) {
    check_products(table);
    table.products = products_of(table);
  }
  // Where leaves overlap by Gaussians, have products, or a missing value sends rows to both sides, the two sides of a
  // split cannot be kept in order.
  const bool may_order = orders_splits && options.validity != ValidityChoice::gaussian &&
                         options.terms == LocalTerms::linear && !inputs.hasNaN();
  if (!table.monotone.empty() && !may_order) {
    std::erase_if(table.split_inputs, [&](int j) { return table.monotone[j] != 0; });
  }
  return table;
}

std::vector<Eigen::Index> rows_of_weight(const Eigen::VectorXd& weights) {
  // Weights are at most 1. A weight below 1e-12 changes nothing but rounding.
  constexpr double smallest = 1e-12;
  std::vector<Eigen::Index> kept;
  for (Eigen::Index row = 0; row < weights.size(); ++row) {
    if (weights(row) > smallest) kept.push_back(row);
  }
  return kept;
}

}  // namespace

FitData::FitData(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
                 const FitOptions& options, bool orders_splits)
    : folds_(options.folds), table_(make_table(inputs, outputs, options, orders_splits)) {
  std::vector<Eigen::Index> rows = rows_of_weight(table_->weights);
  row_of_.assign(inputs.rows(), -1);
  for (int i = 0; i < count_of(rows); ++i) row_of_[rows[i]] = i;
  Eigen::VectorXd weights = table_->weights;
  if (!options.folds.groups.empty()) {
    for (const Eigen::Index row : rows) groups_.push_back(options.folds.groups[row]);
  } else if (options.folds.count > 0) {
    const EqualRows equal = find_equal_rows(inputs, outputs, rows, options.max_threads);
    has_repeats_ = equal.are_repeats;
    if (has_repeats_) groups_.assign(equal.group.begin(), equal.group.end());
    if (!equal.copy_of.empty()) leave_out_copies(equal.copy_of, rows, weights);
  }
  if (!groups_.empty()) folds_.groups = groups_;
  if (std::ssize(rows) == inputs.rows()) return;
  inputs_ = inputs(rows, Eigen::all);
  outputs_ = outputs(rows, Eigen::all);
  FitOptions of_kept = options;
  of_kept.weights = weights(rows);
  table_.emplace(make_table(inputs_, outputs_, of_kept, orders_splits));
}

Table FitData::trained(const Eigen::VectorXd& loss_weights) const {
  Table result = table();
  if (loss_weights.size() == 0) return result;
  Eigen::VectorXd of_table = Eigen::VectorXd::Ones(result.weights.size());
  for (Eigen::Index row = 0; row < loss_weights.size(); ++row) {
    if (row_of_[row] >= 0) of_table(row_of_[row]) = loss_weights(row);
  }
  result.weights = result.weights.cwiseProduct(of_table);
  return result;
}

// Adds the weights of copies to those of the rows that they copy, and leaves them out of `rows`.
void FitData::leave_out_copies(const std::vector<int>& copy_of, std::vector<Eigen::Index>& rows,
                               Eigen::VectorXd& weights) {
  std::vector<Eigen::Index> left;
  std::vector<double> groups;
  for (int i = 0; i < count_of(rows); ++i) {
    if (copy_of[i] != i) {
      weights(rows[copy_of[i]]) += weights(rows[i]);
      row_of_[rows[i]] = row_of_[rows[copy_of[i]]];
      continue;
    }
    row_of_[rows[i]] = count_of(left);
    left.push_back(rows[i]);
    if (has_repeats_) groups.push_back(groups_[i]);
  }
  copies_ = std::ssize(rows) - std::ssize(left);
  rows = std::move(left);
  groups_ = std::move(groups);
}

}  // namespace llmt
