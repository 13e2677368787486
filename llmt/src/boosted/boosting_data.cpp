#include "boosted/boosting_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>

#include "base/count.hpp"
#include "base/memory.hpp"
#include "boosted/memory.hpp"
#include "boosted/model/boosted_checks.hpp"
#include "boosted/packed_sums.hpp"
#include "data/column_order.hpp"
#include "data/equal_rows.hpp"
#include "data/given_rows.hpp"
#include "llmt/random.hpp"

namespace llmt {
namespace {

constexpr double largest_extent = 1e100;  // sums of two standardised inputs stay finite
constexpr Eigen::Index fewest_groups = 5;

void check_options(const BoostOptions& options) {
  if (!(options.rate >= 0.0 && options.rate <= 1.0)) {
    throw std::invalid_argument(
        fmt::format("llmt::fit_boosted: rate is {}, it must be from 0 (chosen) to 1", options.rate));
  }
  if (options.seeds < 1 || options.seeds > most_seeds) {
    throw std::invalid_argument(
        fmt::format("llmt::fit_boosted: seeds is {}, it must be from 1 to {}", options.seeds, most_seeds));
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

DifferentRows different_rows(const GivenRows& given) {
  const std::vector<Eigen::Index> rows = counted_rows(given);
  const RowNumbers numbers =
      given.numbers ? at(*given.numbers, rows) : number_rows(given.inputs.values, given.outputs.values, rows);
  const bool weighted = given.weights.size() > 0 && !given.are_counts;
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
    result.weights[found->second] += weighted ? given.weights(row) : 1.0;
  }
  return result;
}

// Of each of the rows a number that those share which are held out together.
std::vector<int> units_of(const GivenRows& given, const std::vector<Eigen::Index>& rows) {
  if (given.groups.empty()) {
    const EqualRows equal = find_equal_rows(given.inputs.values, rows, at(*given.numbers, rows));
    return equal.group.empty() ? all_rows(std::ssize(rows)) : equal.group;
  }
  std::vector<int> units;
  std::map<double, int> seen;
  for (const Eigen::Index row : rows) {
    units.push_back(seen.try_emplace(given.groups[row], count_of(seen)).first->second);
  }
  return units;
}

// The part of each row; rows of one unit are in one part.
std::vector<int> deal(const std::vector<int>& units, const Regime& regime, std::uint64_t seed) {
  const Eigen::Index count = std::ranges::max(units) + 1;
  if (count < fewest_groups) {
    throw std::invalid_argument(
        fmt::format("llmt::fit_boosted: groups of rows: {}; at least {} are needed", count, fewest_groups));
  }
  const Eigen::Index num_parts = std::min(num_parts_of(regime, std::ssize(units)), count);
  const std::vector<Eigen::Index> order = Random(seed).permutation(count);
  std::vector<int> part(count);
  for (Eigen::Index k = 0; k < count; ++k) part[order[k]] = static_cast<int>(k % num_parts);
  std::vector<int> result;
  for (const int unit : units) result.push_back(part[unit]);
  return result;
}

// Puts the rows in random order, so that any of them one after the other are a fair sample, and those of the part 0,
// which are held out, behind all others.
void shuffle(DifferentRows& rows, std::vector<int>& parts, std::uint64_t seed) {
  const std::vector<Eigen::Index> order = Random(seed).permutation(std::ssize(rows.first));
  DifferentRows ordered;
  std::vector<int> ordered_parts;
  for (const bool held_out : {false, true}) {
    for (const Eigen::Index k : order) {
      if ((parts[k] == 0) != held_out) continue;
      ordered.first.push_back(rows.first[k]);
      ordered.weights.push_back(rows.weights[k]);
      ordered_parts.push_back(parts[k]);
    }
  }
  rows = std::move(ordered);
  parts = std::move(ordered_parts);
}

// The column of an input, and the deviation that its values are divided by.
std::pair<InputColumn, double> describe(const TrainingData& data, const GivenRows& given, const BoostingData& result,
                                        Eigen::Index input) {
  const int place = result.columns[input];
  InputColumn column;
  column.name = data.input_names.empty() ? fmt::format("x{}", place + 1) : data.input_names[place];
  const auto visit_values = [&](const auto& visit) {
    for (Eigen::Index i = 0; i < result.x.rows(); ++i) {
      if (!std::isnan(result.x(i, input))) visit(result.x(i, input), result.rows.weights(i));
    }
  };
  double weight = 0.0;
  double sum = 0.0;
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  visit_values([&](double value, double of_row) {
    low = std::min(low, value);
    high = std::max(high, value);
    weight += of_row;
    sum += of_row * value;
  });
  if (weight == 0.0) low = high = 0.0;
  column.low = low;
  column.high = high;
  if (weight == 0.0) return {column, 1.0};
  column.centre = std::clamp(sum / weight, low, high);
  if (std::ranges::count(given.categorical, place) > 0) {
    const auto levels = static_cast<int>(high) + 1;
    const bool has_empty_level = !given.empty_levels.empty() && std::cmp_equal(given.empty_levels[place], levels);
    for (int level = 0; level < levels; ++level) {
      if (has_empty_level && level + 1 == levels) {
        column.levels.emplace_back();
        break;
      }
      const bool has_name = !data.levels.empty() && !data.levels[place].empty();
      column.levels.push_back(has_name ? data.levels[place][level] : fmt::format("{}", level));
    }
    return {column, 1.0};
  }
  double squares = 0.0;
  visit_values(
      [&](double value, double of_row) { squares += of_row * (value - column.centre) * (value - column.centre); });
  const double deviation = squares > 0.0 ? std::sqrt(squares / weight) : 1.0;
  return {column, std::max(std::abs(low), std::abs(high)) / deviation > largest_extent ? 1.0 : deviation};
}

void describe_columns(const TrainingData& data, const GivenRows& given, BoostingData& result) {
  for (Eigen::Index j = 0; j < result.x.cols(); ++j) {
    auto [column, deviation] = describe(data, given, result, j);
    result.inputs.push_back(std::move(column));
    result.deviations.push_back(deviation);
  }
  for (Eigen::Index o = 0; o < result.y.cols(); ++o) {
    const std::string name = result.y.cols() == 1 ? "y" : fmt::format("y{}", o + 1);
    result.outputs.push_back({.name = data.output_names.empty() ? name : data.output_names[o],
                              .low = result.y.col(o).minCoeff(),
                              .high = result.y.col(o).maxCoeff()});
  }
}

// The levels of an input that have features, ascending: the most frequent ones.
std::vector<int> levels_with_features(const BoostingData& data, int input) {
  constexpr Eigen::Index fewest = 50;
  constexpr Eigen::Index most_cells_of_levels = 200'000'000;
  std::vector<int> levels(data.inputs[input].levels.size());
  std::iota(levels.begin(), levels.end(), 0);
  const Eigen::Index most = std::clamp<Eigen::Index>(most_cells_of_levels / data.x.rows(), fewest, most_boosted_levels);
  if (std::ssize(levels) <= most) return levels;
  std::vector<double> weights(levels.size(), 0.0);
  for (Eigen::Index i = 0; i < data.x.rows(); ++i) {
    const double level = data.x(i, input);
    if (!std::isnan(level)) weights[static_cast<std::size_t>(level)] += data.rows.weights(i);
  }
  std::ranges::stable_sort(levels, std::ranges::greater(), [&](int level) { return weights[level]; });
  levels.resize(most);
  std::ranges::sort(levels);
  return levels;
}

}  // namespace

BinnedFeature feature_of(const BoostingData& data, const BoostedFeature& feature) {
  Eigen::VectorXd values(data.x.rows());
  std::vector<double> row(data.x.cols());  // no other input of it is read
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    for (const int input : feature.inputs) row[input] = data.x(i, input);
    values(i) = feature_at(feature, data.inputs, data.deviations, row.data());
  }
  return bin_feature(feature, values, data.rows.weights);
}

HoldOut part_apart(const std::vector<int>& parts, int part) {
  HoldOut rows;
  for (int row = 0; row < std::ssize(parts); ++row) {
    (parts[row] == part ? rows.held_out : rows.train).push_back(row);
  }
  return rows;
}

BoostingData boosting_data(const TrainingData& data, const BoostOptions& options) {
  check_options(options);
  const GivenRows given = checked(given_rows(data), {.max_threads = options.max_threads});
  DifferentRows different = different_rows(given);
  const Eigen::Index count = std::ssize(different.first);
  const bool few = count < fewest_boosted_rows;
  if (few && !options.mean_of_few) {
    throw std::invalid_argument(
        fmt::format("llmt::fit_boosted: different rows: {}; a sum of trees needs at least {}, one tree takes fewer",
                    count, fewest_boosted_rows));
  }
  if (count > most_boosted_rows) {
    throw std::invalid_argument(
        fmt::format("llmt::fit_boosted: there are {} different rows, at most {} are taken", count, most_boosted_rows));
  }
  BoostingData result;
  result.is_hold_out_given = !given.held_out.empty();
  result.regime = regime_of(result.is_hold_out_given ? std::max(count, enough_for_one_hold_out) : count,
                            given.inputs.values.cols());
  if (result.is_hold_out_given) {
    for (const Eigen::Index row : different.first) result.parts.push_back(given.held_out[row] ? 0 : 1);
  } else if (!few) {
    result.parts = deal(units_of(given, different.first), result.regime, options.seed);
  }
  if (result.regime.searched < no_limit) shuffle(different, result.parts, options.seed);
  result.x = given.inputs.values(different.first, Eigen::all);
  result.columns = column_order(result.x);
  result.x = given.inputs.values(different.first, result.columns);
  result.y = given.outputs.values(different.first, Eigen::all);
  result.rows.weights = Eigen::Map<const Eigen::VectorXd>(different.weights.data(), count);
  if (given.weights.size() > 0 && !given.are_counts) result.rows.weights /= result.rows.weights.mean();
  if (given.weights.size() > 0 && !given.are_counts) result.precisions = given.weights(different.first);
  result.rows.equal_weights = (result.rows.weights.array() == 1.0).all();
  describe_columns(data, given, result);
  if (few) return result;  // nothing can be held out
  Eigen::Index levels = 0;
  for (int j = 0; j < std::ssize(result.inputs); ++j) levels += std::ssize(levels_with_features(result, j));
  refuse_beyond_memory(SumSize{.rows = count, .inputs = result.x.cols(), .outputs = result.y.cols(), .levels = levels},
                       machine_memory());
  const Eigen::Index turns = result.regime.takes_turns ? num_parts_of(result.regime, count) : 1;
  for (int part = 0; part < turns; ++part) result.hold_outs.push_back(part_apart(result.parts, part));
  for (int j = 0; j < std::ssize(result.inputs); ++j) {
    if (!result.inputs[j].is_categorical()) result.rows.features.push_back(feature_of(result, {.inputs = {j}}));
    for (const int level : levels_with_features(result, j)) {
      result.rows.features.push_back(feature_of(result, {.inputs = {j}, .level = level}));
    }
  }
  return result;
}

}  // namespace llmt
