#include "data/make_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "base/checks.hpp"
#include "data/regressors.hpp"
#include "data/row_weight.hpp"

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

void check_outputs(const Eigen::Ref<const Eigen::MatrixXd>& outputs, Eigen::Index rows) {
  check_size("outputs", outputs);
  check_finite("llmt::fit", "outputs", outputs);
  check_magnitudes("outputs", outputs);
  if (rows != outputs.rows()) {
    throw std::invalid_argument(fmt::format("llmt::fit: inputs has {} rows, outputs has {}", rows, outputs.rows()));
  }
  require(rows <= std::numeric_limits<int>::max(), "the number of rows", static_cast<double>(rows), "below 2^31");
}

std::vector<int> all_columns(Eigen::Index count) {
  std::vector<int> columns(count);
  std::iota(columns.begin(), columns.end(), 0);
  return columns;
}

bool contains(const std::vector<int>& columns, int column) {
  return std::ranges::find(columns, column) != columns.end();
}

// Number of levels of every input, 0 for numbers.
std::vector<int> count_levels(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const std::vector<int>& categorical) {
  std::vector<int> num_levels(inputs.cols(), 0);
  for (const int column : categorical) {
    int& levels = num_levels[column];
    levels = 1;  // all missing: a category that never occurs
    for (const double value : inputs.col(column)) {
      if (!std::isnan(value)) levels = std::max(levels, static_cast<int>(value) + 1);
    }
  }
  return num_levels;
}

void check_trends(const std::vector<Trend>& trends, const std::vector<int>& categorical, Eigen::Index inputs) {
  if (!trends.empty() && std::ssize(trends) != inputs) {
    throw std::invalid_argument(
        fmt::format("llmt::fit: trends has {} entries, there are {} inputs", trends.size(), inputs));
  }
  for (int j = 0; j < std::ssize(trends); ++j) {
    if (trends[j] == Trend::any || !contains(categorical, j)) continue;
    throw std::invalid_argument(
        fmt::format("llmt::fit: trends[{}] must be any: the input is categorical, its values have no order", j));
  }
}

bool is_monotone(Trend trend) { return trend == Trend::rising || trend == Trend::falling; }

int sign_of(Trend trend) {
  if (trend == Trend::any) return 0;
  return trend == Trend::rising || trend == Trend::rising_slopes ? 1 : -1;
}

// Signs of slopes and of the prediction.
void set_signs(const std::vector<Trend>& trends, Table& table) {
  for (const Trend trend : trends) table.slope_signs.push_back(sign_of(trend));
  if (std::ranges::none_of(trends, is_monotone)) return;
  for (const Trend trend : trends) table.monotone.push_back(is_monotone(trend) ? sign_of(trend) : 0);
}

void check_weights(const Eigen::VectorXd& weights, Eigen::Index rows) {
  if (weights.size() == 0) return;
  if (weights.size() != rows) {
    throw std::invalid_argument(
        fmt::format("llmt::fit: weights has {} entries, inputs has {} rows", weights.size(), rows));
  }
  for (Eigen::Index row = 0; row < rows; ++row) {
    if (is_row_weight(weights(row))) continue;
    require(false, fmt::format("weights({}), counted from 0,", row).c_str(), weights(row), words_of_row_weight);
  }
  require(weights.maxCoeff() > 0.0, "the largest weight", weights.maxCoeff(), "positive");
}

void check_products(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const std::vector<int>& categorical,
                    const FitOptions& options) {
  const Eigen::Index numbers = count_numeric_inputs(inputs.cols(), categorical, options);
  require(numbers <= most_inputs_of_products,
          "the number of numeric regression inputs of quadratic local models (terms)", static_cast<double>(numbers),
          "at most 13; regression_inputs chooses them");
  const double largest = largest_of(inputs);
  require(largest <= largest_factor, "a magnitude in inputs, with quadratic local models,", largest, "at most 1e70");
}

}  // namespace

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

void check_data(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
                const Eigen::VectorXd& weights, const std::vector<int>& categorical, const FitOptions& options) {
  check_size("inputs", inputs);
  check_finite_or_missing("llmt::fit", "inputs", inputs);
  check_magnitudes("inputs", inputs);
  check_outputs(outputs, inputs.rows());
  check_weights(weights, inputs.rows());
  check_trends(options.trends, categorical, inputs.cols());
  if (options.terms == LocalTerms::quadratic) check_products(inputs, categorical, options);
}

Table make_table(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
                 Eigen::VectorXd weights, const std::vector<int>& categorical, const FitOptions& options,
                 bool orders_splits) {
  Table table{inputs,
              outputs,
              std::move(weights),
              count_levels(inputs, categorical),
              options.regression_inputs,
              options.split_inputs};
  for (std::vector<int>* columns : {&table.split_inputs, &table.regression_inputs}) {
    if (columns->empty()) {
      *columns = all_columns(inputs.cols());
    }
    std::sort(columns->begin(), columns->end());
  }
  set_signs(options.trends, table);
  if (options.terms == LocalTerms::quadratic) table.products = products_of(table);
  // Where leaves overlap by Gaussians, have products, or a missing value sends rows to both sides, the two sides of a
  // split cannot be kept in order.
  const bool may_order = orders_splits && options.validity != ValidityChoice::gaussian &&
                         options.terms == LocalTerms::linear && !inputs.hasNaN();
  if (!table.monotone.empty() && !may_order) {
    std::erase_if(table.split_inputs, [&](int j) { return table.monotone[j] != 0; });
  }
  return table;
}

}  // namespace llmt
