#include "report/table/columns.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>

#include "llmt/options.hpp"

namespace llmt::report {
namespace {

constexpr double no_value = std::numeric_limits<double>::quiet_NaN();
constexpr double no_level = -1.0;  // a category that the model does not know

// Names and their numbers, looked up without a copy.
using Numbering = std::map<std::string, Eigen::Index, std::less<>>;

// Writes the categories of a column into `values`; returns their sorted names.
std::vector<std::string> take_levels(const Numbering& in_order_of_appearance, Eigen::Ref<Eigen::VectorXd> values) {
  std::vector<std::string> levels;
  std::vector<double> positions(in_order_of_appearance.size());
  for (const auto& [name, appearance] : in_order_of_appearance) {
    positions[appearance] = static_cast<double>(levels.size());
    levels.push_back(name);
  }
  for (double& value : values) {
    value = std::isnan(value) ? no_value : positions[static_cast<std::size_t>(value)];
  }
  if (levels.empty()) {
    levels.emplace_back("(none)");  // a declared category that is missing in every row
  }
  return levels;
}

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::ranges::find(names, name) != names.end();
}

// Replaces the listed columns of `inputs` by categories. `declared`: the names of those in which NA and the like are
// words.
void read_categories(const Csv& csv, const std::vector<std::string>& names, const std::vector<std::string>& declared,
                     InputColumns& inputs) {
  std::vector<std::string> wanted;
  for (const int column : inputs.categorical) {
    wanted.push_back(names[column]);
  }
  std::vector<Numbering> seen(wanted.size());
  std::vector<Numbering> marks(wanted.size());  // with their counts
  csv.visit_texts(wanted, [&](Eigen::Index row, std::size_t i, std::string_view text) {
    double& value = inputs.values(row, inputs.categorical[i]);
    if (says_missing(text) && (text.empty() || !contains(declared, wanted[i]))) {
      value = no_value;
      if (!text.empty()) ++marks[i].emplace(text, 0).first->second;
      return;
    }
    auto found = seen[i].find(text);
    if (found == seen[i].end()) {
      if (seen[i].size() == most_categories) inputs.beyond_limit.push_back({inputs.categorical[i], row});
      found = seen[i].emplace(text, std::ssize(seen[i])).first;
    }
    value = static_cast<double>(found->second);
  });
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const int column = inputs.categorical[i];
    inputs.levels[column] = take_levels(seen[i], inputs.values.col(column));
    for (const auto& [text, count] : marks[i]) inputs.marked.push_back({column, text, count});
  }
}

// Advice on the first of the cells that are no numbers: correct them if most cells of the column are numbers.
std::string advice_on_odd_cell(const Csv& csv, std::span<const std::string> columns,
                               const std::vector<ColumnCells>& cells, std::span<const Eigen::Index> first_bad,
                               const ColumnAdvice& advice) {
  const std::size_t column = std::ranges::min_element(first_bad) - first_bad.begin();
  const ColumnCells& of = cells[column];
  const Eigen::Index numbers = csv.rows() - of.missing - of.other;
  if (of.infinite == of.other) return advice.leave_out;
  if (numbers <= of.other) {
    return fmt::format("; {} of {} cells of the column are numbers: {} {} takes all for categories{}", numbers,
                       csv.rows(), advice.as_categories, columns[column], advice.leave_out);
  }
  if (of.other == 1) {
    return "; all other cells of the column are numbers or empty: correct this one, or empty it (a missing value)";
  }
  return fmt::format("; {} cells of the column are no numbers, {} are: correct those, or empty them (missing values)",
                     of.other, numbers);
}

// Csv::refuse_first() for targets and weights, with the number of all rows that lack one.
void refuse_rows_without_target(const Csv& csv, std::span<const std::string> columns,
                                std::span<const Eigen::Index> first_bad, const Eigen::MatrixXd& values) {
  try {
    csv.refuse_first(columns, first_bad);
  } catch (const DecimalMarkError&) {
    throw;
  } catch (const std::runtime_error& error) {
    constexpr std::size_t named = 5;
    std::vector<Eigen::Index> rows;
    Eigen::Index count = 0;
    for (Eigen::Index row = 0; row < values.rows(); ++row) {
      if (!values.row(row).array().isNaN().any()) continue;
      if (rows.size() < named) rows.push_back(row);
      ++count;
    }
    if (count < 2) throw;
    throw std::runtime_error(
        fmt::format("{}; {} rows have no number there, lines {}{}: delete these lines or fill in the cells",
                    error.what(), count, fmt::join(csv.lines_of(rows), ", "), count > std::ssize(rows) ? ", ..." : ""));
  }
}

}  // namespace

void refuse_large(const Csv& csv, std::span<const std::string> columns, const Eigen::MatrixXd& values,
                  std::span<const double> most) {
  const auto is_large = [&](Eigen::Index column) { return (values.col(column).array().abs() > most[column]).any(); };
  bool any = false;
  for (Eigen::Index column = 0; column < values.cols(); ++column) {
    any = any || is_large(column);
  }
  if (!any) return;
  for (Eigen::Index row = 0; row < values.rows(); ++row) {
    for (Eigen::Index column = 0; column < values.cols(); ++column) {
      if (const double value = values(row, column); std::abs(value) > most[column]) {
        csv.refuse(row, columns[column],
                   fmt::format("{} is beyond {}, the largest magnitude to learn from", value, most[column]));
      }
    }
  }
}

void LargestMagnitude::add(const Csv& csv, const Eigen::Ref<const Eigen::VectorXd>& column) {
  Eigen::Index row = -1;
  for (Eigen::Index i = 0; i < column.size(); ++i) {
    if (std::abs(column(i)) > value) {  // not NaN
      value = std::abs(column(i));
      row = i;
    }
  }
  if (row >= 0 && value < smallest_magnitude) line = csv.line_of(row);  // else nobody asks, and lines are counted
}

void LargestMagnitude::refuse_small(const std::string& file, const std::string& column) const {
  if (value == 0.0 || value >= smallest_magnitude) return;
  throw std::runtime_error(fmt::format(
      "{}:{}: column \"{}\": the largest magnitude of the column is {}, so that squares vanish: at least {} is needed, "
      "by another unit",
      file, line, column, value, smallest_magnitude));
}

void refuse_negative_weight(const Csv& csv, const std::string& column, const Eigen::VectorXd& weights) {
  for (Eigen::Index row = 0; row < weights.size(); ++row) {
    if (weights(row) < 0.0) {
      csv.refuse(row, column, fmt::format("a weight must not be negative, it is {}", weights(row)));
    }
  }
}

LearningColumns read_learning_columns(const Csv& csv, const ColumnRoles& roles, const ColumnAdvice& advice,
                                      double largest_input, int max_threads) {
  for (const std::string& name : roles.categorical) {
    if (!contains(roles.inputs, name)) {
      throw std::runtime_error(fmt::format("{}: column \"{}\" is categorical, but not an input", csv.name(), name));
    }
  }
  // All in one go over the text; what remains of `values` then is the inputs.
  const std::size_t num_inputs = roles.inputs.size();
  std::vector<std::string> columns = roles.inputs;
  columns.insert(columns.end(), roles.targets.begin(), roles.targets.end());
  if (!roles.weight.empty()) {
    columns.push_back(roles.weight);
  }
  auto [values, cells] = csv.read_numbers(columns, max_threads);

  LearningColumns result;
  std::vector<Eigen::Index> bad(columns.size(), ColumnCells::no_row);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const bool is_input = i < num_inputs;
    const bool only_words = cells[i].other > cells[i].infinite + cells[i].other_mark + cells[i].thousands &&
                            cells[i].other + cells[i].missing == csv.rows();
    if (is_input && (only_words || contains(roles.categorical, columns[i]))) {
      result.inputs.categorical.push_back(static_cast<int>(i));
    } else {
      if (only_words && cells[i].other_mark == 0) {
        throw std::runtime_error(fmt::format("{}: column \"{}\" holds words; the {} must be a number", csv.name(),
                                             columns[i], i < num_inputs + roles.targets.size() ? "target" : "weight"));
      }
      bad[i] = is_input ? cells[i].first_other : std::min(cells[i].first_other, cells[i].first_missing);
    }
  }
  const std::span<const std::string> names(columns);
  const std::span<const Eigen::Index> bad_rows(bad);
  refuse_rows_without_target(csv, names.subspan(num_inputs), bad_rows.subspan(num_inputs),
                             values.rightCols(std::ssize(columns) - std::ssize(roles.inputs)));
  try {
    csv.refuse_first(names.first(num_inputs), bad_rows.first(num_inputs));
  } catch (const DecimalMarkError&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(error.what() + advice_on_odd_cell(csv, names, cells, bad_rows.first(num_inputs), advice));
  }

  std::vector<double> most(columns.size(), largest_magnitude);
  std::fill_n(most.begin(), num_inputs, largest_input);
  for (const int column : result.inputs.categorical) {
    most[column] = std::numeric_limits<double>::infinity();
  }
  refuse_large(csv, columns, values, most);
  for (std::size_t i = 0; i < num_inputs + roles.targets.size(); ++i) {
    if (std::isinf(most[i])) continue;
    LargestMagnitude largest;
    largest.add(csv, values.col(i));
    largest.refuse_small(csv.name(), columns[i]);
  }
  result.targets = values.middleCols(std::ssize(roles.inputs), std::ssize(roles.targets));
  if (!roles.weight.empty()) {
    result.weights = values.rightCols(1);
    refuse_negative_weight(csv, roles.weight, result.weights);
    if (result.weights.isZero(0.0)) {
      throw std::runtime_error(fmt::format("{}: column \"{}\": every weight is 0", csv.name(), roles.weight));
    }
  }
  values.conservativeResize(Eigen::NoChange, std::ssize(roles.inputs));
  result.inputs.values = std::move(values);
  result.inputs.levels.resize(num_inputs);
  read_categories(csv, roles.inputs, roles.categorical, result.inputs);
  for (int i = 0; i < static_cast<int>(num_inputs); ++i) {
    const bool is_listed = std::ranges::count(result.inputs.marked, i, &MarkedCells::column) > 0;
    result.inputs.has_other_marks = result.inputs.has_other_marks || (!is_listed && cells[i].marked > 0);
  }
  return result;
}

namespace {

ModelInputs read_inputs(const Csv& csv, const std::vector<InputColumn>& model_inputs, const std::vector<bool>& used,
                        int max_threads) {
  std::vector<std::string> columns;
  std::vector<std::string> categorical;
  std::vector<Eigen::Index> column_of;  // per categorical column
  std::vector<Numbering> levels;
  std::vector<Eigen::Index> input_of;  // per column read
  for (Eigen::Index j = 0; j < std::ssize(model_inputs); ++j) {
    const InputColumn& input = model_inputs[j];
    if (!used[j] && !csv.has(input.name)) continue;
    if (input.is_categorical() && input.codes.empty()) {
      column_of.push_back(std::ssize(columns));
      categorical.push_back(input.name);
      Numbering& numbering = levels.emplace_back();
      for (std::size_t k = 0; k < input.levels.size(); ++k) {
        numbering.emplace(input.levels[k], k);
      }
    }
    columns.push_back(input.name);
    input_of.push_back(j);
  }
  auto [values, cells] = csv.read_numbers(columns, max_threads);
  ModelInputs inputs{std::move(values)};
  inputs.unknown_words.resize(model_inputs.size());
  std::vector<Eigen::Index> bad;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const InputColumn& input = model_inputs[input_of[i]];
    const std::vector<double>& codes = input.codes;
    const bool is_number = !input.is_categorical() || !codes.empty();
    for (Eigen::Index row = 0; row < csv.rows() && !codes.empty(); ++row) {
      const double value = inputs.values(row, static_cast<Eigen::Index>(i));
      inputs.unseen_codes += !std::isnan(value) && !std::ranges::binary_search(codes, value) ? 1 : 0;
    }
    bad.push_back(is_number ? cells[i].first_other : ColumnCells::no_row);
    if (is_number) inputs.missing += cells[i].missing;
  }
  csv.refuse_first(columns, bad);
  csv.visit_texts(categorical, [&](Eigen::Index row, std::size_t i, std::string_view text) {
    const auto found = levels[i].find(text);
    double& value = inputs.values(row, column_of[i]);
    if (found != levels[i].end()) {
      value = static_cast<double>(found->second);
      inputs.missing += text.empty() ? 1 : 0;
    } else if (says_missing(text)) {
      value = no_value;
      ++inputs.missing;
    } else {
      value = no_level;
      ++inputs.unknown;
      UnknownWords& words = inputs.unknown_words[static_cast<std::size_t>(input_of[column_of[i]])];
      const auto known = words.find(text);
      ++(known != words.end() ? known : words.emplace(text, 0).first)->second;
    }
  });
  if (std::ssize(columns) < std::ssize(model_inputs)) {
    Eigen::MatrixXd all = Eigen::MatrixXd::Constant(csv.rows(), std::ssize(model_inputs), no_value);
    all(Eigen::all, input_of) = inputs.values;
    inputs.values = std::move(all);
  }
  return inputs;
}

}  // namespace

ModelInputs read_inputs(const Csv& csv, const Model& model, int max_threads) {
  return read_inputs(csv, model.inputs(), used_inputs(model), max_threads);
}

ModelInputs read_inputs(const Csv& csv, const BoostedModel& model, int max_threads) {
  return read_inputs(csv, model.inputs(), used_inputs(model), max_threads);
}

}  // namespace llmt::report
