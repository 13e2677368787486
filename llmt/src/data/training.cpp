#include "data/training.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

#include "base/count.hpp"
#include "data/make_table.hpp"
#include "data/rounding.hpp"

namespace llmt {
namespace {

// Weights are at most 1. One below this changes nothing but rounding.
constexpr double smallest_weight = 1e-12;

// Whole weights are counts up to this mean of those that are not 0.
constexpr double most_counts = 10.0;

// Divided by the largest.
Eigen::VectorXd scaled_weights(const Eigen::VectorXd& given, Eigen::Index rows) {
  if (given.size() == 0) return Eigen::VectorXd::Ones(rows);
  const double largest = given.maxCoeff();
  if (!(largest > 0.0)) {
    throw std::invalid_argument(fmt::format("llmt::fit: the largest weight is {}, it must be positive", largest));
  }
  return given / largest;
}

template <class Values>
Values values_at(const Values& values, const std::vector<Eigen::Index>& rows) {
  if (values.size() == 0) return {};
  Values result(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) result[i] = values[rows[i]];
  return result;
}

// Rows, each as often as it counts, without those that are copies of others.
struct WithoutCopies {
  std::vector<Eigen::Index> left;  // positions among the rows
  std::vector<int> left_as;        // of each row, where it or the row that it copies stands in `left`
};

// Adds the weights of copies to those of the rows that they copy. `copy_of`: of each row, the one that it copies.
WithoutCopies leave_out_copies(const std::vector<int>& copy_of, Eigen::VectorXd& weights) {
  WithoutCopies result;
  for (int i = 0; i < count_of(copy_of); ++i) {
    const int copied = copy_of[i];
    if (copied != i) weights(copied) += weights(i);
    result.left_as.push_back(copied != i ? result.left_as[copied] : count_of(result.left));
    if (copied == i) result.left.push_back(i);
  }
  return result;
}

// The number of different ones among ascending rows.
Eigen::Index different(const std::vector<Eigen::Index>& rows) {
  Eigen::Index count = rows.empty() ? 0 : 1;
  for (std::size_t i = 1; i < rows.size(); ++i) count += rows[i] != rows[i - 1] ? 1 : 0;
  return count;
}

// Rows that the caller holds out copy nothing and are not copied: what is learned must not depend on them.
EqualRows equal_rows(const GivenRows& given, const std::vector<Eigen::Index>& rows) {
  const Eigen::Ref<const Eigen::MatrixXd>& inputs = given.inputs.values;
  if (given.held_out.empty()) return find_equal_rows(inputs, rows, at(*given.numbers, rows));
  std::vector<int> positions;
  std::vector<Eigen::Index> learned;
  for (int i = 0; i < count_of(rows); ++i) {
    if (given.held_out[rows[i]]) continue;
    positions.push_back(i);
    learned.push_back(rows[i]);
  }
  EqualRows equal = find_equal_rows(inputs, learned, at(*given.numbers, learned));
  // From positions among the learned rows to positions among all of them; the others stand for themselves.
  if (!equal.copy_of.empty()) {
    std::vector<int> copy_of(rows.size());
    std::iota(copy_of.begin(), copy_of.end(), 0);
    for (std::size_t i = 0; i < positions.size(); ++i) copy_of[positions[i]] = positions[equal.copy_of[i]];
    equal.copy_of = std::move(copy_of);
  }
  if (!equal.group.empty()) {
    std::vector<int> group(rows.size());
    std::iota(group.begin(), group.end(), 1 + std::ranges::max(equal.group));
    for (std::size_t i = 0; i < positions.size(); ++i) group[positions[i]] = equal.group[i];
    equal.group = std::move(group);
  }
  return equal;
}

// The fold of the rows that the caller holds out; none if some rows lack one of its sides.
std::vector<Fold> given_fold(const std::vector<bool>& held_out, const std::vector<Eigen::Index>& rows) {
  Fold fold;
  for (Eigen::Index i = 0; i < std::ssize(rows); ++i) (held_out[rows[i]] ? fold.held_out : fold.train).push_back(i);
  if (fold.held_out.empty() || fold.train.empty()) return {};
  return {std::move(fold)};
}

bool are_counts(const Eigen::VectorXd& weights) {
  const Eigen::Index positive = (weights.array() > 0.0).count();
  return positive > 0 && (weights.array() == weights.array().floor()).all() &&
         weights.sum() <= most_counts * static_cast<double>(positive);
}

// A view cannot be made to view something else, so the rows are put together anew.
GivenRows with_inputs(GivenRows given, SharedMatrix inputs) {
  return {.inputs = std::move(inputs),
          .outputs = given.outputs,
          .weights = std::move(given.weights),
          .groups = std::move(given.groups),
          .held_out = std::move(given.held_out),
          .are_counts = given.are_counts,
          .categorical = std::move(given.categorical),
          .may_have_codes = given.may_have_codes,
          .loss_weights = std::move(given.loss_weights),
          .numbers = std::move(given.numbers)};
}

void check_groups(const std::vector<double>& groups, Eigen::Index rows) {
  if (groups.empty()) return;
  if (std::ssize(groups) != rows) {
    throw std::invalid_argument(
        fmt::format("llmt::fit: groups has {} entries, inputs has {} rows", groups.size(), rows));
  }
  for (std::size_t row = 0; row < groups.size(); ++row) {
    if (std::isfinite(groups[row])) continue;
    throw std::invalid_argument(fmt::format("llmt::fit: groups[{}] is {}, it must be finite", row, groups[row]));
  }
}

void check_held_out(const GivenRows& given, const FitOptions& options) {
  if (given.held_out.empty()) return;
  if (options.folds.count == 0) {
    throw std::invalid_argument("llmt::fit: held_out has rows to choose on, but folds.count is 0: nothing is chosen");
  }
  const std::vector<Eigen::Index> rows = counted_rows(given);
  const std::string weighted = given.weights.size() > 0 ? " of positive weight" : "";
  if (std::ranges::none_of(rows, [&](Eigen::Index row) { return given.held_out[row]; })) {
    throw std::invalid_argument(fmt::format("llmt::fit: held_out has no row{}", weighted));
  }
  if (std::ranges::all_of(rows, [&](Eigen::Index row) { return given.held_out[row]; })) {
    throw std::invalid_argument(
        fmt::format("llmt::fit: held_out has all rows{}, none is left to learn from", weighted));
  }
}

}  // namespace

std::optional<RowNumbers> numbers_at(const GivenRows& given, const std::vector<Eigen::Index>& rows) {
  return given.numbers ? std::optional(at(*given.numbers, rows)) : std::nullopt;
}

SharedMatrix shared(Eigen::MatrixXd matrix) {
  auto owned = std::make_shared<const Eigen::MatrixXd>(std::move(matrix));
  return {*owned, owned};
}

GivenRows settled(GivenRows given, int max_threads) {
  std::vector<Eigen::Index> learned;
  for (Eigen::Index row = 0; row < given.inputs.values.rows(); ++row) {
    if (given.held_out.empty() || !given.held_out[row]) learned.push_back(row);
  }
  std::optional<Eigen::MatrixXd> inputs = without_rounding(given.inputs.values, learned, max_threads);
  if (!inputs) return given;
  return with_inputs(std::move(given), shared(*std::move(inputs)));
}

GivenRows checked(GivenRows rows, const FitOptions& options) {
  check_data(rows.inputs.values, rows.outputs.values, rows.weights, rows.categorical, options);
  check_groups(rows.groups, rows.inputs.values.rows());
  rows.are_counts = are_counts(rows.weights);
  check_held_out(rows, options);
  GivenRows given = settled(std::move(rows), options.max_threads);
  if (!given.numbers && given.groups.empty() && options.folds.count > 0) {
    std::vector<Eigen::Index> all(given.inputs.values.rows());
    std::iota(all.begin(), all.end(), 0);
    given.numbers = number_rows(given.inputs.values, given.outputs.values, all, options.max_threads);
  }
  return given;
}

GivenRows rows_at(const GivenRows& given, const std::vector<Eigen::Index>& rows) {
  return {.inputs = shared(given.inputs.values(rows, Eigen::all)),
          .outputs = shared(given.outputs.values(rows, Eigen::all)),
          .weights = values_at(given.weights, rows),
          .groups = values_at(given.groups, rows),
          .held_out = values_at(given.held_out, rows),
          .are_counts = given.are_counts,
          .categorical = given.categorical,
          .empty_levels = given.empty_levels,
          .may_have_codes = given.may_have_codes,
          .loss_weights = values_at(given.loss_weights, rows),
          .numbers = numbers_at(given, rows)};
}

std::vector<Eigen::Index> counted_rows(const GivenRows& given) {
  const Eigen::VectorXd weights = scaled_weights(given.weights, given.inputs.values.rows());
  std::vector<Eigen::Index> rows;
  for (Eigen::Index row = 0; row < weights.size(); ++row) {
    if (!(weights(row) > smallest_weight)) continue;
    rows.insert(rows.end(), given.are_counts ? static_cast<std::size_t>(given.weights(row)) : 1, row);
  }
  return rows;
}

GivenRows counted_rows_at(const GivenRows& given, const std::vector<Eigen::Index>& rows) {
  GivenRows result = rows_at(given, rows);
  if (given.are_counts) result.weights.setOnes();
  return result;
}

KeptRows keep(const GivenRows& given, const FoldOptions& folds) {
  const std::vector<Eigen::Index> counted = counted_rows(given);
  const Eigen::Index count = given.inputs.values.rows();
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(std::ssize(counted));
  if (given.weights.size() > 0 && !given.are_counts) weights = scaled_weights(given.weights, count)(counted);
  EqualRows equal;
  if (given.groups.empty() && given.numbers && folds.count > 0) equal = equal_rows(given, counted);
  std::vector<int> copy_of = std::move(equal.copy_of);
  if (copy_of.empty()) {
    copy_of.resize(counted.size());
    std::iota(copy_of.begin(), copy_of.end(), 0);
  }
  const WithoutCopies without = leave_out_copies(copy_of, weights);
  std::vector<Eigen::Index> rows = values_at(counted, without.left);
  const bool all = std::ssize(rows) == count && std::ranges::adjacent_find(rows) == rows.end();
  KeptRows kept{.inputs = all ? given.inputs : shared(given.inputs.values(rows, Eigen::all)),
                .outputs = all ? given.outputs : shared(given.outputs.values(rows, Eigen::all)),
                .weights = all && std::ssize(counted) == count
                               ? weights
                               : scaled_weights(weights(without.left), std::ssize(rows)),
                .precisions = given.are_counts ? Eigen::VectorXd() : values_at(given.weights, rows),
                .loss_weights = values_at(given.loss_weights, rows),
                .has_repeats = equal.are_repeats,
                .is_fold_given = !given.held_out.empty()};
  if (!all) {
    check_magnitudes("inputs", kept.inputs.values);
    check_magnitudes("outputs", kept.outputs.values);
  }
  if (equal.are_repeats) {
    for (const Eigen::Index position : without.left) kept.groups.push_back(equal.group[position]);
    kept.kind = values_at(equal.group, without.left);
  } else if (given.numbers) {
    kept.kind = values_at(at(*given.numbers, counted).by_inputs, without.left);
  }
  if (!given.groups.empty()) kept.groups = values_at(given.groups, rows);
  for (std::size_t i = 0; i < counted.size(); ++i) {
    kept.places.push_back({static_cast<int>(counted[i]), without.left_as[i]});
  }
  kept.copies = different(counted) - different(rows);
  kept.rows = std::move(rows);
  kept.folds =
      kept.is_fold_given ? given_fold(given.held_out, kept.rows) : selection_folds(kept.count(), folds, kept.groups);
  return kept;
}

std::vector<int> copies_of(const KeptRows& kept) {
  std::vector<int> copies(static_cast<std::size_t>(kept.count()), 0);
  for (const RowPlace& place : kept.places) ++copies[static_cast<std::size_t>(place.kept)];
  return copies;
}

Eigen::Index learned_rows(const KeptRows& kept) {
  std::vector<bool> is_held_out(kept.count(), false);
  for (std::size_t f = 0; kept.is_fold_given && f < kept.folds.size(); ++f) {
    for (const Eigen::Index row : kept.folds[f].held_out) is_held_out[row] = true;
  }
  std::vector<Eigen::Index> given;
  for (const RowPlace& place : kept.places) {
    if (!is_held_out[place.kept]) given.push_back(place.given);
  }
  return different(given);
}

std::vector<std::vector<Eigen::Index>> held_out_rows(const KeptRows& kept) {
  std::vector<int> fold_of(kept.count(), -1);
  for (int f = 0; f < count_of(kept.folds); ++f) {
    for (const Eigen::Index row : kept.folds[f].held_out) fold_of[row] = f;
  }
  std::vector<std::vector<Eigen::Index>> rows(kept.folds.size());
  for (const RowPlace& place : kept.places) {
    if (fold_of[place.kept] < 0) continue;
    std::vector<Eigen::Index>& of_fold = rows[fold_of[place.kept]];
    if (of_fold.empty() || of_fold.back() != place.given) of_fold.push_back(place.given);
  }
  return rows;
}

Training make_training(std::shared_ptr<const KeptRows> kept, const SharedMatrix& inputs, std::vector<int> categorical,
                       const FitOptions& options, bool orders_splits, const MissingWeights& missing_weights) {
  const auto table = std::make_shared<const Table>(
      make_table(inputs.values, kept->outputs.values, kept->weights, categorical, options, orders_splits));
  const auto weighted = std::make_shared<Table>(*table);
  if (kept->loss_weights.size() > 0) weighted->weights = weighted->weights.cwiseProduct(kept->loss_weights);
  std::vector<int> rows(kept->count());
  std::iota(rows.begin(), rows.end(), 0);
  if (kept->is_fold_given && !kept->folds.empty()) {
    const std::vector<Eigen::Index>& learned = kept->folds.front().train;
    rows.assign(learned.begin(), learned.end());
  }
  const int threads = options.max_threads;
  TrainingRows all = training_rows(*weighted, rows, threads);
  if (missing_weights && inputs.values.hasNaN()) {
    const Eigen::VectorXd by_missing = missing_weights(all);
    for (std::size_t i = 0; i < rows.size(); ++i)
      weighted->weights(rows[i]) *= by_missing(static_cast<Eigen::Index>(i));
    all = training_rows(*weighted, std::move(rows), threads);
  }
  TrainingRows measured = with_table(all, *table);
  std::vector<FoldRows> folds = deal(*weighted, *table, kept->folds, threads);
  return {options,  std::move(categorical), std::move(kept),     inputs,          table,
          weighted, std::move(all),         std::move(measured), std::move(folds)};
}

Training narrowed(const Training& training, const std::vector<int>& of_all,
                  const std::vector<std::vector<int>>& of_folds) {
  std::vector<FoldRows> folds;
  for (std::size_t f = 0; f < training.folds.size(); ++f) {
    folds.push_back(
        {narrowed(training.folds[f].training, of_folds[f]), narrowed(training.folds[f].held_out, of_folds[f])});
  }
  return {training.options,
          training.categorical,
          training.kept,
          training.inputs,
          training.table,
          training.weighted,
          narrowed(training.all, of_all),
          narrowed(training.measured, of_all),
          std::move(folds),
          training.taught};
}

}  // namespace llmt
