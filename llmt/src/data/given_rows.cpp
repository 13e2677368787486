#include "data/given_rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/checks.hpp"
#include "llmt/options.hpp"

namespace llmt {
namespace {

void check_count(const char* what, std::size_t count, Eigen::Index columns, const char* of) {
  if (std::cmp_equal(count, columns)) return;
  throw std::invalid_argument(fmt::format("llmt::fit: {} has {} entries, there are {} {}", what, count, columns, of));
}

void check_different(const std::string& what, const std::vector<std::string>& names) {
  std::vector<std::string_view> sorted(names.begin(), names.end());
  std::ranges::sort(sorted);
  const auto found = std::ranges::adjacent_find(sorted);
  if (found == sorted.end()) return;
  throw std::invalid_argument(fmt::format("llmt::fit: two entries of {} are \"{}\"", what, *found));
}

void check_names(const TrainingData& data) {
  if (!data.input_names.empty()) check_count("input_names", data.input_names.size(), data.inputs.cols(), "inputs");
  if (!data.output_names.empty()) check_count("output_names", data.output_names.size(), data.outputs.cols(), "outputs");
  if (!data.levels.empty()) check_count("levels", data.levels.size(), data.inputs.cols(), "inputs");
  check_different("input_names", data.input_names);
  check_different("output_names", data.output_names);
  for (std::size_t j = 0; j < data.levels.size(); ++j) {
    const std::size_t count = data.levels[j].size();
    if (std::cmp_greater(count, most_categories)) {
      throw std::invalid_argument(
          fmt::format("llmt::fit: levels[{}] has {} entries, it must have at most {}", j, count, most_categories));
    }
    check_different(fmt::format("levels[{}]", j), data.levels[j]);
  }
}

void check_categories(const TrainingData& data, int input, std::size_t count, const std::string& why = "") {
  for (const double value : data.inputs.col(input)) {
    if (std::isnan(value) || (value >= 0.0 && value < static_cast<double>(count) && value == std::floor(value)))
      continue;
    throw std::invalid_argument(
        fmt::format("llmt::fit: a category of input {} is {}, it must be a whole number from 0 to {}{}", input, value,
                    count - 1, why));
  }
}

std::vector<int> categorical_of(const TrainingData& data) {
  std::vector<int> categorical = data.categorical_inputs;
  check_columns("llmt::fit", "categorical_inputs", categorical, data.inputs.cols());
  for (const int input : categorical) check_categories(data, input, most_categories);
  for (int input = 0; input < std::ssize(data.levels); ++input) {
    const std::size_t count = data.levels[input].size();
    if (count == 0) continue;
    check_categories(data, input, count, fmt::format(": it has {} levels", count));
    if (std::ranges::find(categorical, input) == categorical.end()) categorical.push_back(input);
  }
  return categorical;
}

// True for each row that is held out; empty: the fit deals folds.
std::vector<bool> held_out_of(const TrainingData& data) {
  const Eigen::Index rows = data.inputs.rows();
  std::vector<bool> held_out(data.held_out.empty() ? 0 : rows, false);
  for (std::size_t i = 0; i < data.held_out.size(); ++i) {
    const Eigen::Index row = data.held_out[i];
    if (row < 0 || row >= rows) {
      throw std::invalid_argument(
          fmt::format("llmt::fit: held_out[{}] is {}, it must be a row from 0 to {}", i, row, rows - 1));
    }
    if (held_out[row]) throw std::invalid_argument(fmt::format("llmt::fit: held_out has row {} twice", row));
    held_out[row] = true;
  }
  return held_out;
}

// The level that missing values of a categorical input have: behind those with names, or behind those that occur.
std::size_t empty_level_of(const TrainingData& data, int input) {
  if (!data.levels.empty() && !data.levels[input].empty()) {
    const std::vector<std::string>& names = data.levels[input];
    return names.size() - (names.back().empty() ? 1 : 0);
  }
  double highest = -1.0;
  for (const double value : data.inputs.col(input)) highest = std::max(highest, std::isnan(value) ? -1.0 : value);
  return static_cast<std::size_t>(highest + 1.0);
}

// The inputs with a level of its own for missing values of categorical ones: that nothing is there may say something.
// Sets GivenRows::empty_levels.
SharedMatrix with_empty_levels(const TrainingData& data, std::vector<int> categorical,
                               std::vector<std::size_t>& empty_levels) {
  std::erase_if(categorical, [&](int input) {
    const auto column = data.inputs.col(input).array();
    return !column.isNaN().any() || column.isNaN().all();
  });
  if (categorical.empty()) return {data.inputs};
  empty_levels.resize(data.inputs.cols(), 0);
  Eigen::MatrixXd inputs = data.inputs;
  for (const int input : categorical) {
    const std::size_t level = empty_level_of(data, input);
    empty_levels[input] = level + 1;
    for (double& value : inputs.col(input)) {
      if (std::isnan(value)) value = static_cast<double>(level);
    }
  }
  return shared(std::move(inputs));
}

}  // namespace

GivenRows given_rows(const TrainingData& data) {
  check_names(data);
  std::vector<int> categorical = categorical_of(data);
  std::vector<std::size_t> empty_levels;
  SharedMatrix inputs = with_empty_levels(data, categorical, empty_levels);
  return {.inputs = std::move(inputs),
          .outputs = {data.outputs},
          .weights = data.weights,
          .groups = data.groups,
          .held_out = held_out_of(data),
          .categorical = std::move(categorical),
          .empty_levels = std::move(empty_levels),
          .may_have_codes = data.may_have_codes};
}

}  // namespace llmt
