#include "fit/validate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "base/checks.hpp"
#include "data/regressors.hpp"
#include "fit/defaults.hpp"

namespace llmt {
namespace {

void require(bool condition, const char* option, double value, const char* bound) {
  if (!condition) {
    throw std::invalid_argument(fmt::format("llmt::fit: {} is {}, it must be {}", option, value, bound));
  }
}

void check_data(const char* name, const Eigen::Ref<const Eigen::MatrixXd>& data) {
  if (data.rows() < 1 || data.cols() < 1) {
    throw std::invalid_argument(fmt::format("llmt::fit: {} is {} x {}, at least one row and one column are needed",
                                            name, data.rows(), data.cols()));
  }
  check_finite("llmt::fit", name, data);
  require(data.cwiseAbs().maxCoeff() <= largest_magnitude, fmt::format("a magnitude in {}", name).c_str(),
          data.cwiseAbs().maxCoeff(), "at most 1e150");
}

void check_inputs(const Eigen::Ref<const Eigen::MatrixXd>& inputs) {
  if (inputs.rows() < 1 || inputs.cols() < 1) {
    throw std::invalid_argument(fmt::format("llmt::fit: inputs is {} x {}, at least one row and one column are needed",
                                            inputs.rows(), inputs.cols()));
  }
  check_finite_or_missing("llmt::fit", "inputs", inputs);
  const double largest = inputs.array().isNaN().select(0.0, inputs).cwiseAbs().maxCoeff();
  require(largest <= largest_magnitude, "a magnitude in inputs", largest, "at most 1e150");
}

std::vector<int> all_columns(Eigen::Index count) {
  std::vector<int> columns(count);
  std::iota(columns.begin(), columns.end(), 0);
  return columns;
}

void check_growth(const GrowthOptions& options, Eigen::Index inputs) {
  require(std::isfinite(options.significance), "growth.significance", options.significance, "finite");
  require(std::isfinite(options.min_variance_gain), "growth.min_variance_gain", options.min_variance_gain, "finite");
  require(options.min_leaf_samples >= 0, "growth.min_leaf_samples", static_cast<double>(options.min_leaf_samples),
          "at least 0");
  require(options.max_leaves >= 0, "growth.max_leaves", static_cast<double>(options.max_leaves), "at least 0");
  require(options.min_improvement >= 0.0 && options.min_improvement < 1.0, "growth.min_improvement",
          options.min_improvement, "in [0, 1)");
  check_columns("llmt::fit", "growth.split_inputs", options.split_inputs, inputs);
  check_columns("llmt::fit", "growth.regression_inputs", options.regression_inputs, inputs);
}

void check_blend(const BlendOptions& options) {
  for (const double width : options.widths) {
    require(std::isfinite(width) && width > 0.0, "blend.widths", width, "finite and positive");
  }
  for (const double ridge : options.ridges) {
    require(ridge >= 0.0 && std::isfinite(ridge), "blend.ridges", ridge, "finite and not negative");
  }
  for (const double shrinkage : options.shrinkages) {
    require(shrinkage >= 0.0 && std::isfinite(shrinkage), "blend.shrinkages", shrinkage, "finite and not negative");
  }
  for (const double jump : options.jumps) {
    require(jump >= 0.0, "blend.jumps", jump, "not negative");
  }
}

// M5' has models of its own: dropped inputs, smoothing along the path. Estimating them anew would undo it.
void check_m5(const FitOptions& options) {
  if (options.blend.validity == ValidityChoice::blend || options.blend.validity == ValidityChoice::gaussian) {
    throw std::invalid_argument(
        fmt::format("llmt::fit: blend.validity is {}, with growth.rule m5 it must be automatic or crisp",
                    options.blend.validity == ValidityChoice::blend ? "blend" : "gaussian"));
  }
  for (const double shrinkage : options.blend.shrinkages) {
    require(shrinkage == 0.0, "blend.shrinkages", shrinkage, "0 with growth.rule m5, which smooths along the path");
  }
  require(options.growth.min_improvement == 0.0, "growth.min_improvement", options.growth.min_improvement,
          "0 with growth.rule m5, which prunes");
  if (options.growth.pruning != Pruning::last_splits || options.local_models.terms != LocalTerms::linear ||
      options.local_models.sparse != SparseChoice::never) {
    throw std::invalid_argument(
        "llmt::fit: growth.pruning, local_models.terms and local_models.sparse must be as they are by default with "
        "growth.rule m5, which has its own local models and pruning");
  }
}

// Number of levels of every input, 0 for numbers.
std::vector<int> count_levels(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const std::vector<int>& categorical) {
  check_columns("llmt::fit", "categorical_inputs", categorical, inputs.cols());
  std::vector<int> num_levels(inputs.cols(), 0);
  constexpr double most = 10000.0;
  for (const int column : categorical) {
    for (const double value : inputs.col(column)) {
      if (std::isnan(value)) continue;
      require(value >= 0.0 && value < most && value == std::floor(value),
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

// Whether splits may be made on inputs in which the prediction is to be monotone: where gates and local models are
// made of functions of one input each and no missing value sends a row to both sides, see docs/algorithms.md.
bool may_order_splits(const FitOptions& options, const Eigen::Ref<const Eigen::MatrixXd>& inputs) {
  const GrowthRule rule = options.growth.rule;
  return (rule == GrowthRule::rd || rule == GrowthRule::retis || rule == GrowthRule::ra) &&
         options.blend.validity != ValidityChoice::gaussian && options.local_models.terms == LocalTerms::linear &&
         !inputs.hasNaN();
}

}  // namespace

void check_options(const FitOptions& options, Eigen::Index inputs) {
  check_growth(options.growth, inputs);
  check_blend(options.blend);
  require(options.local_models.sparse == SparseChoice::never || options.blend.estimation != Estimation::as_grown ||
              (options.blend.validity == ValidityChoice::crisp && !is_lolimot(options.growth.rule)),
          "local_models.sparse", static_cast<double>(options.local_models.sparse),
          "never where blend.estimation is as_grown, for those models are full");
  if ((!options.monotone.empty() || !options.slope_signs.empty()) &&
      options.local_models.sparse != SparseChoice::never) {
    throw std::invalid_argument("llmt::fit: monotone and slope_signs need local_models.sparse never");
  }
  if (options.growth.rule == GrowthRule::m5) {
    check_m5(options);
  }
  require(options.max_threads >= 0, "max_threads", options.max_threads, "at least 0");
  if (options.growth.rule == GrowthRule::hilomot && options.blend.validity != ValidityChoice::automatic &&
      options.blend.validity != ValidityChoice::crisp) {
    throw std::invalid_argument(
        "llmt::fit: blend.validity must be automatic or crisp for growth.rule hilomot, whose gates are logistic");
  }
}

Table make_table(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
                 const FitOptions& options) {
  check_inputs(inputs);
  check_data("outputs", outputs);
  if (inputs.rows() != outputs.rows()) {
    throw std::invalid_argument(
        fmt::format("llmt::fit: inputs has {} rows, outputs has {}", inputs.rows(), outputs.rows()));
  }
  require(inputs.rows() <= std::numeric_limits<int>::max(), "the number of rows", static_cast<double>(inputs.rows()),
          "below 2^31");
  Table table{inputs,
              outputs,
              options.weights,
              count_levels(inputs, options.categorical_inputs),
              options.growth.regression_inputs,
              options.growth.split_inputs};
  if (table.weights.size() == 0) {
    table.weights = Eigen::VectorXd::Ones(inputs.rows());
  } else {
    if (table.weights.size() != inputs.rows()) {
      throw std::invalid_argument(
          fmt::format("llmt::fit: weights has {} entries, inputs has {} rows", table.weights.size(), inputs.rows()));
    }
    check_finite("llmt::fit", "weights", table.weights);
    require(table.weights.minCoeff() >= 0.0, "a weight", table.weights.minCoeff(), "at least 0");
    require(table.weights.maxCoeff() > 0.0, "the largest weight", table.weights.maxCoeff(), "positive");
    table.weights /= table.weights.maxCoeff();
  }
  for (std::vector<int>* columns : {&table.split_inputs, &table.regression_inputs}) {
    if (columns->empty()) {
      *columns = all_columns(inputs.cols());
    }
    std::sort(columns->begin(), columns->end());
  }
  set_signs(options, table);
  if (options.local_models.terms == LocalTerms::quadratic) {
    const Eigen::Index numbers = std::ssize(numeric_regression_inputs(table));
    require(numbers <= most_inputs_of_products,
            "the number of numeric regression inputs of quadratic local models (local_models.terms)",
            static_cast<double>(numbers), "at most 13; growth.regression_inputs chooses them");
    const double largest = inputs.array().isNaN().select(0.0, inputs).cwiseAbs().maxCoeff();
    require(largest <= largest_factor, "a magnitude in inputs, with quadratic local models,", largest, "at most 1e70");
    table.products = products_of(table);
  }
  if (!table.monotone.empty() && !may_order_splits(options, inputs)) {
    std::erase_if(table.split_inputs, [&](int j) { return table.monotone[j] != 0; });
  }
  return table;
}

std::vector<Eigen::Index> rows_with_weight(const Table& table) {
  std::vector<Eigen::Index> result;
  for (Eigen::Index row = 0; row < table.weights.size(); ++row) {
    // Far below the largest, a weight changes nothing but rounding.
    if (table.weights(row) > 1e-12) {
      result.push_back(row);
    }
  }
  return result;
}

std::vector<Fold> selection_folds(Eigen::Index rows, const SelectionOptions& selection) {
  FoldOptions options = selection.folds;
  if (options.count == 0) return {};
  require(options.count >= 2, "selection.folds.count", options.count, "0 or at least 2");
  std::vector<double> distinct(options.groups.begin(), options.groups.end());
  std::ranges::sort(distinct);
  distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
  const Eigen::Index groups = options.groups.empty() ? rows : std::ssize(distinct);
  options.count = static_cast<int>(std::min<Eigen::Index>(options.count, groups));
  if (options.count < 2) return {};
  std::vector<Fold> folds = make_folds(rows, options);
  if (rows >= single_hold_out_rows) {
    folds.resize(1);
  }
  return folds;
}

}  // namespace llmt
