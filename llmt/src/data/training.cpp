#include "data/training.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "base/count.hpp"
#include "data/make_table.hpp"

namespace llmt {
namespace {

// Weights are at most 1. One below this changes nothing but rounding.
constexpr double smallest_weight = 1e-12;

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

// Where the rows that take part stand, as in KeptRows.
struct Places {
  std::vector<Eigen::Index> rows = {};
  std::vector<int> row_of = {};
  std::vector<double> groups = {};
  Eigen::Index copies = 0;
};

// Adds the weights of copies to those of the rows that they copy, and leaves them out. `copy_of`: of each row that
// takes part, the one that it copies.
void leave_out_copies(const std::vector<int>& copy_of, Eigen::VectorXd& weights, Places& places) {
  std::vector<Eigen::Index> left;
  std::vector<double> groups;
  for (int i = 0; i < count_of(places.rows); ++i) {
    const Eigen::Index row = places.rows[i];
    const Eigen::Index copied = places.rows[copy_of[i]];
    if (copied != row) {
      weights(copied) += weights(row);
      places.row_of[row] = places.row_of[copied];
      continue;
    }
    places.row_of[row] = count_of(left);
    left.push_back(row);
    if (!places.groups.empty()) groups.push_back(places.groups[i]);
  }
  places.copies = std::ssize(places.rows) - std::ssize(left);
  places.rows = std::move(left);
  places.groups = std::move(groups);
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

}  // namespace

std::optional<RowNumbers> numbers_at(const GivenRows& given, const std::vector<Eigen::Index>& rows) {
  return given.numbers ? std::optional(at(*given.numbers, rows)) : std::nullopt;
}

SharedMatrix shared(Eigen::MatrixXd matrix) {
  auto owned = std::make_shared<const Eigen::MatrixXd>(std::move(matrix));
  return {*owned, owned};
}

GivenRows checked(GivenRows given, const FitOptions& options) {
  const Eigen::Ref<const Eigen::MatrixXd>& inputs = given.inputs.values;
  const Eigen::Ref<const Eigen::MatrixXd>& outputs = given.outputs.values;
  check_data(inputs, outputs, given.weights, given.categorical, options);
  check_groups(given.groups, inputs.rows());
  if (!given.numbers && given.groups.empty() && options.folds.count > 0) {
    std::vector<Eigen::Index> all(inputs.rows());
    std::iota(all.begin(), all.end(), 0);
    given.numbers = number_rows(inputs, outputs, all, options.max_threads);
  }
  return given;
}

GivenRows rows_at(const GivenRows& given, const std::vector<Eigen::Index>& rows) {
  return {.inputs = shared(given.inputs.values(rows, Eigen::all)),
          .outputs = shared(given.outputs.values(rows, Eigen::all)),
          .weights = values_at(given.weights, rows),
          .groups = values_at(given.groups, rows),
          .categorical = given.categorical,
          .may_have_codes = given.may_have_codes,
          .loss_weights = values_at(given.loss_weights, rows),
          .numbers = numbers_at(given, rows)};
}

KeptRows keep(const GivenRows& given, const FoldOptions& folds) {
  const Eigen::Index count = given.inputs.values.rows();
  Eigen::VectorXd weights = scaled_weights(given.weights, count);
  Places places{.row_of = std::vector<int>(count, -1)};
  for (Eigen::Index row = 0; row < count; ++row) {
    if (!(weights(row) > smallest_weight)) continue;
    places.row_of[row] = count_of(places.rows);
    places.rows.push_back(row);
  }
  EqualRows equal;
  if (given.groups.empty() && given.numbers && folds.count > 0) {
    equal = find_equal_rows(given.inputs.values, places.rows, at(*given.numbers, places.rows));
    if (equal.are_repeats) places.groups.assign(equal.group.begin(), equal.group.end());
    if (!equal.copy_of.empty()) leave_out_copies(equal.copy_of, weights, places);
  }
  if (!given.groups.empty()) places.groups = values_at(given.groups, places.rows);
  const std::vector<Eigen::Index>& rows = places.rows;
  const bool all = std::ssize(rows) == count;
  KeptRows kept{.inputs = all ? given.inputs : shared(given.inputs.values(rows, Eigen::all)),
                .outputs = all ? given.outputs : shared(given.outputs.values(rows, Eigen::all)),
                .weights = all ? weights : scaled_weights(weights(rows), std::ssize(rows)),
                .loss_weights = values_at(given.loss_weights, rows),
                .copies = places.copies,
                .has_repeats = equal.are_repeats};
  if (!all) {
    check_magnitudes("inputs", kept.inputs.values);
    check_magnitudes("outputs", kept.outputs.values);
  }
  kept.groups = std::move(places.groups);
  kept.rows = std::move(places.rows);
  kept.row_of = std::move(places.row_of);
  kept.folds = selection_folds(kept.count(), folds, kept.groups);
  return kept;
}

std::vector<std::vector<Eigen::Index>> held_out_rows(const KeptRows& kept) {
  std::vector<int> fold_of(kept.count(), -1);
  for (int f = 0; f < count_of(kept.folds); ++f) {
    for (const Eigen::Index row : kept.folds[f].held_out) fold_of[row] = f;
  }
  std::vector<std::vector<Eigen::Index>> rows(kept.folds.size());
  for (Eigen::Index row = 0; row < std::ssize(kept.row_of); ++row) {
    const int of_kept = kept.row_of[row];
    if (of_kept >= 0 && fold_of[of_kept] >= 0) rows[fold_of[of_kept]].push_back(row);
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
  const int threads = options.max_threads;
  TrainingRows all = training_rows(*weighted, rows, threads);
  if (missing_weights && inputs.values.hasNaN()) {
    weighted->weights = weighted->weights.cwiseProduct(missing_weights(all));
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
          std::move(folds)};
}

}  // namespace llmt
