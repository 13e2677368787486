#include "trees/arrow_learning.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "shared/options.hpp"
#include "trees/accidental.hpp"

namespace llmt::apps {
namespace {

TrainingData read_into_memory(const TableFiles& table, const LearningArguments& arguments) {
  std::vector<std::string> columns = choose_inputs(table.columns(), table.name(), arguments);
  TrainingData data;
  data.input_names = columns;
  data.output_names = arguments.targets;
  const Eigen::Index inputs = std::ssize(columns);
  columns.insert(columns.end(), arguments.targets.begin(), arguments.targets.end());
  if (!arguments.weight.empty()) columns.push_back(arguments.weight);
  table.require_numbers({columns.begin() + inputs, columns.end()});
  data.levels = table.levels(data.input_names, std::numeric_limits<std::size_t>::max());
  constexpr double part_of_memory = 0.05;  // fits on several threads hold some ten times the table
  const double bytes = 8.0 * static_cast<double>(table.rows()) * static_cast<double>(columns.size());
  const double most = part_of_memory * static_cast<double>(physical_memory());
  if (bytes > most) {
    throw std::runtime_error(fmt::format(
        "{}: {} rows are too many to compare in memory; write a part of them with llmt table {} --every {:.0f} "
        "-o part.arrow",
        table.name(), table.rows(), arguments.data, std::ceil(bytes / most)));
  }
  const Eigen::MatrixXd rows = table.read(0, table.rows(), columns, data.levels);
  check_rows(table, columns, inputs, rows, 0);
  report::InputColumns read{.values = rows.leftCols(inputs), .levels = std::move(data.levels), .categorical = {}};
  for (int column = 0; column < inputs; ++column) {
    if (!read.levels[column].empty()) read.categorical.push_back(column);
  }
  leave_out_accidental(arguments, data.input_names, read);
  for (std::size_t k = 0; k < read.levels.size(); ++k) {
    if (std::cmp_greater(read.levels[k].size(), most_categories)) {
      throw std::runtime_error(fmt::format("{}: column \"{}\" has more than {} different words; --ignore leaves it out",
                                           table.name(), data.input_names[k], most_categories));
    }
  }
  data.inputs = std::move(read.values);
  data.levels = std::move(read.levels);
  data.outputs = rows.middleCols(inputs, std::ssize(arguments.targets));
  if (!arguments.weight.empty()) data.weights = rows.rightCols(1);
  if (!arguments.groups.empty()) {
    const std::vector<std::string> groups = {arguments.groups};
    table.require_numbers(groups);
    const Eigen::MatrixXd numbers = table.read(0, table.rows(), groups, {{}});
    for (Eigen::Index row = 0; row < numbers.rows(); ++row) {
      if (std::isnan(numbers(row, 0))) table.refuse(row, arguments.groups, "says the groups and is missing");
    }
    data.groups.assign(numbers.data(), numbers.data() + numbers.size());
  }
  data.may_have_codes = arguments.may_have_codes;
  return data;
}

}  // namespace

double physical_memory() {
  return static_cast<double>(::sysconf(_SC_PHYS_PAGES)) * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

void check_rows(const TableFiles& table, std::span<const std::string> columns, Eigen::Index inputs,
                const Eigen::MatrixXd& rows, Eigen::Index first) {
  for (Eigen::Index j = 0; j < rows.cols(); ++j) {
    const bool is_weight = j > inputs;
    for (Eigen::Index i = 0; i < rows.rows(); ++i) {
      const double value = rows(i, j);
      if (std::isnan(value) && j < inputs) continue;
      if (std::abs(value) <= largest_magnitude && !(is_weight && value < 0.0)) continue;
      table.refuse(first + i, columns[j],
                   std::isnan(value) ? "is missing"
                   : value < 0.0 && is_weight
                       ? fmt::format("a weight must not be negative, it is {}", value)
                       : fmt::format("{} is beyond {}, the largest magnitude to learn from", value, largest_magnitude));
    }
  }
}

LearningTable read_arrow_learning_table(const LearningArguments& arguments) {
  const TableFiles table({arguments.data});
  if (table.rows() == 0) throw std::runtime_error(fmt::format("{}: there are columns and no rows", table.name()));
  if (!arguments.categorical.empty()) {
    throw std::invalid_argument("--categorical is not for Arrow files; give the table as CSV");
  }
  TrainingData data = read_into_memory(table, arguments);
  LearningTable learning{nullptr, arguments.options, std::vector<Eigen::Index>(table.rows())};
  std::iota(learning.lines.begin(), learning.lines.end(), Eigen::Index{1});
  set_columns(arguments.columns, data.input_names, data.levels, learning.options);
  learning.data = std::make_shared<const TrainingData>(std::move(data));
  return learning;
}

}  // namespace llmt::apps
