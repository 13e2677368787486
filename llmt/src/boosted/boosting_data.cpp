#include "boosted/boosting_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "boosted/model/boosted_checks.hpp"
#include "boosted/packed_sums.hpp"
#include "data/equal_rows.hpp"
#include "data/given_rows.hpp"
#include "llmt/random.hpp"

namespace llmt {
namespace {

constexpr double largest_extent = 1e100;  // sums of two standardised inputs stay finite

// Below this number of rows one hold-out decides by chance: five of them decide together.
constexpr Eigen::Index few_rows = 500;
constexpr Eigen::Index fewest_parts = 5;
constexpr Eigen::Index rows_of_part = 20000;  // of many rows: as many decide as well as a fifth

Eigen::Index num_parts_of(Eigen::Index rows) { return rows > many_rows ? rows / rows_of_part : fewest_parts; }

void check_options(const BoostOptions& options) {
  if (!(options.rate >= 0.0 && options.rate <= 1.0)) {
    throw std::invalid_argument(
        fmt::format("llmt::fit_boosted: rate is {}, it must be from 0 (chosen) to 1", options.rate));
  }
  if (options.max_rounds < 1 || options.max_rounds > 100000) {
    throw std::invalid_argument(
        fmt::format("llmt::fit_boosted: max_rounds is {}, it must be from 1 to 100000", options.max_rounds));
  }
  if (options.max_threads < 0) {
    throw std::invalid_argument(
        fmt::format("llmt::fit_boosted: max_threads is {}, it must not be negative", options.max_threads));
  }
}

// Equal rows of one group are one row with their weight, so that a row of the weight k is k rows to the byte.
struct DifferentRows {
  std::vector<Eigen::Index> first;  // of the equal ones
  std::vector<double> weights;
};

DifferentRows different_rows(const GivenRows& given, const RowNumbers& numbers, const std::vector<Eigen::Index>& rows) {
  DifferentRows result;
  std::map<std::tuple<int, double, bool>, std::size_t> seen;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const Eigen::Index row = rows[k];
    const double group = given.groups.empty() ? 0.0 : given.groups[row];
    const bool held_out = !given.held_out.empty() && given.held_out[row];
    const int number = numbers.by_all.empty() ? static_cast<int>(k) : numbers.by_all[k];
    const auto [found, is_new] = seen.try_emplace({number, group, held_out}, result.first.size());
    if (is_new) {
      result.first.push_back(row);
      result.weights.push_back(0.0);
    }
    result.weights[found->second] += given.weights.size() == 0 ? 1.0 : given.weights(row);
  }
  return result;
}

GivenRows checked_rows(const TrainingData& data, const BoostOptions& options) {
  FitOptions checks;
  checks.max_threads = options.max_threads;
  checks.folds.count = 0;  // nothing is dealt, and rows are numbered here
  GivenRows given = given_rows(data);
  std::vector<bool> held_out = std::exchange(given.held_out, {});
  GivenRows result = checked(std::move(given), checks);
  result.held_out = std::move(held_out);
  return result;
}

std::vector<Eigen::Index> weighted_rows(const GivenRows& given) {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index row = 0; row < given.inputs.values.rows(); ++row) {
    if (given.weights.size() == 0 || given.weights(row) > 0.0) rows.push_back(row);
  }
  return rows;
}

// Of each of the rows a number that those share which are held out together.
std::vector<int> units_of(const GivenRows& given, const std::vector<Eigen::Index>& rows) {
  std::vector<int> units(rows.size());
  std::iota(units.begin(), units.end(), 0);
  if (!given.groups.empty()) {
    std::map<double, int> seen;
    for (std::size_t k = 0; k < rows.size(); ++k) {
      units[k] = seen.try_emplace(given.groups[rows[k]], static_cast<int>(seen.size())).first->second;
    }
    return units;
  }
  const RowNumbers numbers = number_rows(given.inputs.values, given.outputs.values, rows);
  if (numbers.by_inputs.empty()) return units;
  const EqualRows equal = find_equal_rows(given.inputs.values, rows, numbers);
  return equal.group.empty() ? units : equal.group;
}

// The part of each row; rows of one unit are in one part.
std::vector<int> deal(const std::vector<int>& units, std::uint64_t seed) {
  const Eigen::Index count = *std::ranges::max_element(units) + 1;
  if (count < fewest_parts) {
    throw std::invalid_argument(
        fmt::format("llmt::fit_boosted: there are {} groups of rows, at least {} are needed", count, fewest_parts));
  }
  const Eigen::Index num_parts = std::min(num_parts_of(std::ssize(units)), count);
  const std::vector<Eigen::Index> order = Random(seed).permutation(count);
  std::vector<int> part(count);
  for (Eigen::Index k = 0; k < count; ++k) part[order[k]] = static_cast<int>(k % num_parts);
  std::vector<int> result;
  for (const int unit : units) result.push_back(part[unit]);
  return result;
}

std::vector<HoldOut> hold_outs_of(const std::vector<int>& part) {
  std::vector<HoldOut> result(std::ssize(part) < few_rows ? fewest_parts : 1);
  for (int k = 0; k < std::ssize(result); ++k) {
    for (int row = 0; row < std::ssize(part); ++row) {
      (part[row] == k ? result[k].held_out : result[k].train).push_back(row);
    }
  }
  return result;
}

HoldOut given_hold_out(const GivenRows& given, const std::vector<Eigen::Index>& rows) {
  HoldOut result;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    (given.held_out[rows[k]] ? result.held_out : result.train).push_back(static_cast<int>(k));
  }
  if (result.held_out.empty() || result.train.empty()) {
    throw std::invalid_argument("llmt::fit_boosted: held_out has all rows that count, or none of them");
  }
  return result;
}

bool is_held_out(const BoostingData& data, const GivenRows& given, const DifferentRows& rows, Eigen::Index k) {
  return data.is_hold_out_given ? given.held_out[rows.first[k]] : data.parts[k] == 0;
}

// Puts the rows in random order, so that any of them one after the other are a fair sample, and those that are held out
// behind all others.
void shuffle(DifferentRows& rows, BoostingData& data, const GivenRows& given, std::uint64_t seed) {
  const std::vector<Eigen::Index> order = Random(seed).permutation(std::ssize(rows.first));
  DifferentRows ordered;
  std::vector<int> parts;
  for (const bool held_out : {false, true}) {
    for (const Eigen::Index k : order) {
      if (is_held_out(data, given, rows, k) != held_out) continue;
      ordered.first.push_back(rows.first[k]);
      ordered.weights.push_back(rows.weights[k]);
      if (!data.parts.empty()) parts.push_back(data.parts[k]);
    }
  }
  rows = std::move(ordered);
  data.parts = std::move(parts);
}

InputColumn describe(const TrainingData& data, const GivenRows& given, const BoostingData& result, Eigen::Index input,
                     double& deviation) {
  InputColumn column;
  const auto name = [&](const auto& names, Eigen::Index k) {
    return names.empty() ? fmt::format("x{}", k + 1) : names[k];
  };
  column.name = name(data.input_names, input);
  const Eigen::VectorXd values = result.x.col(input);
  double weight = 0.0;
  double sum = 0.0;
  column.low = std::numeric_limits<double>::infinity();
  column.high = -column.low;
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    if (std::isnan(values(i))) continue;
    column.low = std::min(column.low, values(i));
    column.high = std::max(column.high, values(i));
    weight += result.rows.weights(i);
    sum += result.rows.weights(i) * values(i);
  }
  deviation = 1.0;
  if (weight == 0.0) {
    column.low = column.high = 0.0;
    return column;
  }
  column.centre = std::clamp(sum / weight, column.low, column.high);
  if (std::ranges::count(given.categorical, input) > 0) {
    const auto levels = static_cast<int>(column.high) + 1;
    if (levels > most_boosted_levels) {
      throw std::invalid_argument(
          fmt::format("llmt::fit_boosted: input \"{}\" has {} levels, boosting takes at most {}; leave it out, or put "
                      "rare levels together",
                      column.name, levels, most_boosted_levels));
    }
    for (int level = 0; level < levels; ++level) {
      const bool has_name = !data.levels.empty() && !data.levels[input].empty();
      column.levels.push_back(has_name ? data.levels[input][level] : fmt::format("{}", level));
    }
    return column;
  }
  double squares = 0.0;
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    if (std::isnan(values(i))) continue;
    const double from_centre = values(i) - column.centre;
    squares += result.rows.weights(i) * from_centre * from_centre;
  }
  if (squares > 0.0) deviation = std::sqrt(squares / weight);
  if (std::max(std::abs(column.low), std::abs(column.high)) / deviation > largest_extent) deviation = 1.0;
  return column;
}

void describe_columns(const TrainingData& data, const GivenRows& given, BoostingData& result) {
  for (Eigen::Index j = 0; j < result.x.cols(); ++j) {
    double deviation = 1.0;
    result.inputs.push_back(describe(data, given, result, j, deviation));
    result.deviations.push_back(deviation);
  }
  for (Eigen::Index o = 0; o < result.y.cols(); ++o) {
    OutputColumn column;
    const bool single = result.y.cols() == 1;
    column.name = !data.output_names.empty() ? data.output_names[o] : single ? "y" : fmt::format("y{}", o + 1);
    column.low = result.y.col(o).minCoeff();
    column.high = result.y.col(o).maxCoeff();
    result.outputs.push_back(column);
  }
}

}  // namespace

void add_feature(BoostingData& data, const BoostedFeature& feature) {
  Eigen::VectorXd values(data.x.rows());
  Eigen::VectorXd row(data.x.cols());
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    row = data.x.row(i);
    values(i) = feature_at(feature, data.inputs, data.deviations, row.data());
  }
  data.rows.features.push_back(bin_feature(feature, values, data.rows.weights));
}

BoostingData boosting_data(const TrainingData& data, const BoostOptions& options) {
  check_options(options);
  const GivenRows given = checked_rows(data, options);
  const std::vector<Eigen::Index> rows = weighted_rows(given);
  const RowNumbers numbers = number_rows(given.inputs.values, given.outputs.values, rows, options.max_threads);
  DifferentRows different = different_rows(given, numbers, rows);
  const bool few = std::ssize(different.first) < fewest_boosted_rows;
  if (few && !options.mean_of_few) {
    throw std::invalid_argument(
        fmt::format("llmt::fit_boosted: different rows: {}; a sum of trees needs at least {}, one tree takes fewer",
                    different.first.size(), fewest_boosted_rows));
  }
  if (std::ssize(different.first) > most_boosted_rows) {
    throw std::invalid_argument(fmt::format("llmt::fit_boosted: there are {} different rows, at most {} are taken",
                                            different.first.size(), most_boosted_rows));
  }
  BoostingData result;
  result.is_hold_out_given = !given.held_out.empty();
  if (!few && !result.is_hold_out_given) result.parts = deal(units_of(given, different.first), options.seed);
  if (std::ssize(different.first) > many_rows) shuffle(different, result, given, options.seed);
  result.x = given.inputs.values(different.first, Eigen::all);
  result.y = given.outputs.values(different.first, Eigen::all);
  result.rows.weights = Eigen::Map<const Eigen::VectorXd>(different.weights.data(), std::ssize(different.weights));
  if (given.weights.size() > 0 && !given.are_counts) result.rows.weights /= result.rows.weights.mean();
  result.rows.equal_weights = (result.rows.weights.array() == 1.0).all();
  if (few) {  // nothing can be held out
    describe_columns(data, given, result);
    return result;
  }
  result.hold_outs = result.is_hold_out_given ? std::vector<HoldOut>{given_hold_out(given, different.first)}
                                              : hold_outs_of(result.parts);
  describe_columns(data, given, result);
  for (int j = 0; j < std::ssize(result.inputs); ++j) {
    const int levels = static_cast<int>(result.inputs[j].levels.size());
    if (levels == 0) add_feature(result, {.first = j});
    for (int level = 0; level < levels; ++level) add_feature(result, {.first = j, .level = level});
  }
  return result;
}

}  // namespace llmt
