#include "trees/compared_tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <stdexcept>

#include "report/signals/signals_summary.hpp"

namespace llmt::apps {
namespace {

// `every_column`: the inputs were not named.
Eigen::MatrixXd read_named_inputs(const Csv& csv, const std::vector<std::string>& names, bool every_column) {
  try {
    return csv.numbers(names);
  } catch (const DecimalMarkError&) {
    throw;
  } catch (const std::runtime_error& error) {
    if (!every_column) throw;
    throw std::runtime_error(
        fmt::format("{} (--inputs COLUMN,... names the columns to use, and leaves out the others)", error.what()));
  }
}

// A time of its own for each row of a run.
void refuse_equal_times(const Csv& csv, const std::string& column, const discovery::Inputs& inputs) {
  std::map<std::pair<Eigen::Index, double>, Eigen::Index> taken;
  for (Eigen::Index i = 0; i < inputs.instants.size(); ++i) {
    const Eigen::Index run = inputs.runs.empty() ? 0 : inputs.runs[i];
    const auto [place, is_new] = taken.try_emplace({run, inputs.instants(i)}, i);
    if (is_new) continue;
    throw std::runtime_error(
        fmt::format("{}:{}: column \"{}\" is {}, as in line {}; rows of a run are taken one after the other{}",
                    csv.name(), csv.line_of(i), column, inputs.instants(i), csv.line_of(place->second),
                    inputs.runs.empty() ? " (--group COLUMN tells several runs apart)" : ""));
  }
}

// Instants, runs and their labels.
void read_times(const ComparedTables& tables, const Csv& simulated, const Csv& measured, Comparison& comparison) {
  if (tables.time.empty()) return;
  if (!tables.group.empty()) {
    const Csv& holder = measured.has(tables.group) ? measured : simulated;
    comparison.inputs.runs = runs_of(holder, tables.group);
    comparison.labels.push_back({tables.group, holder.texts(tables.group)});
  }
  const Csv& holder = measured.has(tables.time) ? measured : simulated;
  comparison.inputs.instants = instants_of(holder, tables.time);
  comparison.labels.insert(comparison.labels.begin(), {tables.time, holder.texts(tables.time)});
  refuse_equal_times(holder, tables.time, comparison.inputs);
  if (measured.has(tables.time) && simulated.has(tables.time)) {
    refuse_other_times(simulated, measured, tables.time, comparison.inputs.instants);
  }
}

}  // namespace

Eigen::MatrixXd read_same_inputs(const Csv& simulated, const Csv& measured, const std::vector<std::string>& names,
                                 bool every_column) {
  const Eigen::MatrixXd one = read_named_inputs(simulated, names, every_column);
  Eigen::MatrixXd other = read_named_inputs(measured, names, every_column);
  // Files are written with a limited number of digits.
  constexpr double rounding = 1e-6;
  const Eigen::RowVectorXd ranges = one.colwise().maxCoeff() - one.colwise().minCoeff();
  for (Eigen::Index i = 0; i < one.rows(); ++i) {
    for (Eigen::Index j = 0; j < one.cols(); ++j) {
      if (std::abs(one(i, j) - other(i, j)) <= rounding * std::max(ranges(j), 1e-3 * std::abs(one(i, j)))) continue;
      throw std::runtime_error(
          fmt::format("{}:{}: column \"{}\" is {}, but {} at {}:{}; rows must stand in the same order in both files",
                      measured.name(), measured.line_of(i), names[j], other(i, j), one(i, j), simulated.name(),
                      simulated.line_of(i)));
    }
  }
  return other;
}

void refuse_other_times(const Csv& simulated, const Csv& measured, const std::string& column,
                        const Eigen::VectorXd& instants) {
  const Eigen::VectorXd others = instants_of(simulated, column);
  const double step = (instants.maxCoeff() - instants.minCoeff()) / static_cast<double>(instants.size());
  for (Eigen::Index i = 0; i < instants.size(); ++i) {
    const double since = instants(i) - instants(0);
    const double other = others(i) - others(0);
    if (std::abs(since - other) <= 0.5 * step) continue;
    throw std::runtime_error(fmt::format(
        "{}:{}: column \"{}\" is {} after the first row, but {} in {}; rows must stand in the same order in both "
        "files, and times have one unit",
        measured.name(), measured.line_of(i), column, since, other, simulated.name()));
  }
}

Eigen::VectorXd instants_of(const Csv& csv, const std::string& column) {
  if (!csv.has(column)) return csv.numbers(column);  // says which columns there are
  try {
    return csv.numbers(column);
  } catch (const DecimalMarkError&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(fmt::format("{} (--time takes numbers, in seconds or any other unit)", error.what()));
  }
}

std::vector<Eigen::Index> runs_of(const Csv& csv, const std::string& column) {
  std::map<std::string, Eigen::Index, std::less<>> numbers;
  std::vector<Eigen::Index> runs(csv.rows());
  csv.visit_texts(std::array{column}, [&](Eigen::Index row, std::size_t, std::string_view label) {
    runs[row] = numbers.try_emplace(std::string(label), std::ssize(numbers)).first->second;
  });
  return runs;
}

void check_names(const ComparedTables& tables) {
  for (const std::vector<std::string>* names : {&tables.inputs, &tables.outputs}) {
    for (std::size_t k = 0; k < names->size(); ++k) {
      const auto rest = names->begin() + k + 1;
      if (std::find(rest, names->end(), (*names)[k]) != names->end()) {
        throw std::invalid_argument(fmt::format("\"{}\" is given twice", (*names)[k]));
      }
    }
  }
  for (const std::string& output : tables.outputs) {
    if (std::ranges::find(tables.inputs, output) != tables.inputs.end() || output == tables.order) {
      throw std::invalid_argument(fmt::format("\"{}\" is an output and cannot be an input or the order", output));
    }
    if (output == tables.time || output == tables.group) {
      throw std::invalid_argument(fmt::format("\"{}\" is an output and cannot be the time or the group", output));
    }
  }
  if (!tables.time.empty() && !tables.order.empty()) {
    throw std::invalid_argument("--time says the order of the rows: --order is not needed beside it");
  }
  if (!tables.group.empty() && tables.time.empty()) {
    throw std::invalid_argument("--group needs --time: the rows of a group follow each other in time");
  }
}

Eigen::VectorXd noise_of(const Csv& csv, const std::vector<std::string>& names) {
  Eigen::VectorXd noise = Eigen::VectorXd::Constant(std::ssize(names), std::nan(""));
  for (std::size_t k = 0; k < names.size(); ++k) {
    const std::string column = report::noise_column(names[k]);
    if (!csv.has(column)) continue;
    const Eigen::VectorXd of_rows = csv.numbers(column);
    Eigen::Index bad = 0;
    if (!(of_rows.minCoeff(&bad) >= 0.0)) {
      throw std::runtime_error(fmt::format("{}:{}: column \"{}\" is {}, must be a standard deviation of at least 0",
                                           csv.name(), csv.line_of(bad), column, of_rows(bad)));
    }
    noise(static_cast<Eigen::Index>(k)) = std::sqrt(of_rows.squaredNorm() / static_cast<double>(of_rows.size()));
  }
  return noise.array().isNaN().all() ? Eigen::VectorXd() : noise;
}

double cutoff_of(const Csv& csv) {
  if (!csv.has(report::cutoff_column)) return 0.0;
  const Eigen::VectorXd of_rows = csv.numbers(report::cutoff_column);
  for (Eigen::Index i = 0; i < of_rows.size(); ++i) {
    if (of_rows(i) > 0.0 && of_rows(i) == of_rows(0)) continue;
    throw std::runtime_error(fmt::format("{}:{}: column \"{}\" is {}, must be above 0 and the same in all rows",
                                         csv.name(), csv.line_of(i), report::cutoff_column, of_rows(i)));
  }
  return of_rows.size() > 0 ? of_rows(0) : 0.0;
}

Comparison read_comparison(const ComparedTables& tables, bool every_column) {
  const Csv simulated = Csv::read(tables.simulated, tables.mark);
  const Csv measured = Csv::read(tables.measured, tables.mark);
  for (const Csv* csv : {&simulated, &measured}) {
    if (csv->rows() == 0) throw std::runtime_error(fmt::format("{}: no rows", csv->name()));
  }
  Comparison comparison;
  comparison.simulated = simulated.numbers(tables.outputs);
  comparison.measured = {tables.outputs, measured.numbers(tables.outputs)};
  comparison.inputs.names = tables.inputs;
  if (simulated.rows() != measured.rows()) {
    throw std::runtime_error(
        fmt::format("{} has {} rows, {} has {}", simulated.name(), simulated.rows(), measured.name(), measured.rows()));
  }
  comparison.inputs.values = read_same_inputs(simulated, measured, tables.inputs, every_column);
  std::vector<Eigen::Index> rows(measured.rows());
  std::iota(rows.begin(), rows.end(), Eigen::Index{0});
  comparison.lines = measured.lines_of(rows);
  read_times(tables, simulated, measured, comparison);
  comparison.inputs.noise = noise_of(measured, tables.inputs);
  comparison.measured.noise = noise_of(measured, tables.outputs);
  if (!tables.time.empty()) comparison.inputs.cutoff = cutoff_of(measured);
  comparison.inputs.order = tables.order;
  if (!tables.order.empty() && std::ranges::find(tables.inputs, tables.order) == tables.inputs.end()) {
    const Csv& holder = measured.has(tables.order) ? measured : simulated;
    Eigen::MatrixXd with_order(comparison.inputs.values.rows(), comparison.inputs.values.cols() + 1);
    with_order.leftCols(comparison.inputs.values.cols()) = comparison.inputs.values;
    with_order.rightCols(1) = holder.numbers(tables.order);
    comparison.inputs.values = with_order;
    comparison.inputs.names.push_back(tables.order);
    if (comparison.inputs.noise.size() > 0) {
      comparison.inputs.noise.conservativeResize(comparison.inputs.values.cols());
      comparison.inputs.noise.tail(1).setZero();
    }
  }
  return comparison;
}

}  // namespace llmt::apps
