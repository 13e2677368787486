#include "llmt/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "check/check_inputs.hpp"
#include "check/check_targets.hpp"
#include "model/codes.hpp"
#include "numerics/two_samples.hpp"
#include "spread/scaled_residuals.hpp"

namespace llmt {
namespace {

// An error that is so much above the promised one is no longer good, where it is beyond chance.
constexpr double tolerated = 1.1;
// Intervals that hold fewer rows are no longer good, where it is beyond chance: CV+ of the level 1 - a guarantees 1 - 2
// a.
constexpr double least_covered = 1.0 - 1.5 * (1.0 - checked_level);
// Errors below this part of the target's range in training are rounding.
constexpr double rounding_share = 1e-9;

void check_arguments(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
                     std::size_t targets, const CheckOptions& options) {
  const auto refuse = [](const std::string& what) { throw std::invalid_argument("llmt::check: " + what); };
  if (!(options.level >= 0.0 && options.level <= 0.5)) {
    refuse(fmt::format("level is {}, it must be from 0 to 0.5", options.level));
  }
  if (outputs.rows() != inputs.rows() || outputs.cols() != static_cast<Eigen::Index>(targets)) {
    refuse(
        fmt::format("outputs are {} x {}, {} x {} are needed", outputs.rows(), outputs.cols(), inputs.rows(), targets));
  }
  if (outputs.array().isInf().any()) refuse("an output is infinite");
  if (!options.limits.empty() && options.limits.size() != targets) {
    refuse(fmt::format("{} limits of {} targets", options.limits.size(), targets));
  }
  const auto is_limit = [](double limit) { return limit > 0.0 && std::isfinite(limit); };
  if (!std::ranges::all_of(options.limits, is_limit)) refuse("a limit is not above 0");
  check_row_weights("llmt::check", options.weights, inputs.rows());
}

// Residuals and the spreads by which they are divided, of the parts of the held-out rows of one output.
struct PartOfOutput {
  const Spread* spread = nullptr;  // null: 1 everywhere
  std::vector<double> residuals;   // ascending
};

std::vector<PartOfOutput> parts_of(const Intervals& intervals, Eigen::Index output) {
  std::vector<PartOfOutput> parts;
  for (const HeldOutPart& part : intervals.parts()) {
    PartOfOutput& of = parts.emplace_back();
    if (!part.spreads.empty()) of.spread = &part.spreads[static_cast<std::size_t>(output)];
    for (const Eigen::MatrixXd* kind : {&part.residuals, &part.incomplete}) {
      for (Eigen::Index row = 0; row < kind->rows(); ++row) of.residuals.push_back((*kind)(row, output));
    }
    std::ranges::sort(of.residuals);
  }
  return parts;
}

std::vector<PartOfOutput> parts_of(const BoostedSum& sum) {
  std::vector<PartOfOutput> parts;
  for (const SumResiduals& part : sum.held_out) parts.push_back({&part.spread, part.residuals});
  return parts;
}

// The new rows as spreads read them.
struct NewRows {
  const Eigen::MatrixXd& at;  // categories as positions
  const std::vector<Eigen::Index>& in_gap;
  const Eigen::VectorXd& weights;
};

Eigen::VectorXd mean_spreads(const std::vector<PartOfOutput>& parts, const NewRows& rows,
                             const Eigen::VectorXd& predicted) {
  Eigen::VectorXd spreads = Eigen::VectorXd::Ones(predicted.size());
  if (parts.empty()) return spreads;
  std::vector<ScaledResiduals> residuals;
  for (const PartOfOutput& part : parts) residuals.push_back({part.residuals});
  const double in_gaps = rows.in_gap.empty() ? 1.0 : factor_in_gaps(residuals);
  for (Eigen::Index row = 0; row < predicted.size(); ++row) {
    double sum = 0.0;
    for (const PartOfOutput& part : parts) {
      const double spread = part.spread == nullptr ? 1.0 : spread_at(*part.spread, rows.at, row, predicted(row));
      const bool is_weighted = rows.weights.size() > 0 && part.spread != nullptr;
      sum += is_weighted ? spread * factor_of_weight(*part.spread, rows.weights(row)) : spread;
    }
    spreads(row) = sum / static_cast<double>(parts.size());
    if (std::ranges::binary_search(rows.in_gap, row)) spreads(row) *= in_gaps;
  }
  return spreads;
}

// Whether there are held-out rows enough for the intervals that are counted.
bool has_bounds(const std::vector<PartOfOutput>& parts) {
  Eigen::Index rows = 0;
  for (const PartOfOutput& part : parts) rows += std::ssize(part.residuals);
  return values_outside(checked_level, rows) >= 1;
}

JudgedTarget judged_target(const OutputColumn& column, const std::vector<PartOfOutput>& parts, const NewRows& rows,
                           const Eigen::VectorXd& observed, const Eigen::VectorXd& predicted) {
  JudgedTarget judged{.column = column,
                      .observed = observed,
                      .predicted = predicted,
                      .spreads = mean_spreads(parts, rows, predicted),
                      .held_out = {}};
  for (const PartOfOutput& part : parts) {
    judged.held_out.insert(judged.held_out.end(), part.residuals.begin(), part.residuals.end());
  }
  return judged;
}

// Holm's correction of all probabilities of the check.
void correct(TableCheck& found) {
  std::vector<double*> tested;
  for (CheckedTarget& target : found.targets) {
    tested.insert(tested.end(), {&target.probability, &target.covered_probability});
    for (CheckedLeaf& leaf : target.leaves) tested.push_back(&leaf.probability);
  }
  for (CheckedInput& input : found.inputs) tested.push_back(&input.probability);
  std::vector<double> probabilities;
  for (const double* probability : tested) probabilities.push_back(*probability);
  const std::vector<double> corrected = holm(probabilities);
  for (std::size_t k = 0; k < tested.size(); ++k) {
    *tested[k] = corrected[k];
    found.tests += std::isnan(corrected[k]) ? 0 : 1;
  }
}

void judge_target(CheckedTarget& target, const OutputColumn& column, const CheckOptions& options, std::size_t output) {
  const auto is_beyond_chance = [&](double probability) { return probability < options.level; };  // not NaN
  const double least = std::max(target.promised, rounding_share * (column.high - column.low));
  const bool has_larger_error = is_beyond_chance(target.probability) && target.rmse > least;
  const bool covers_fewer = is_beyond_chance(target.covered_probability);
  const bool has_limit = !options.limits.empty();
  target.limit = has_limit ? options.limits[output] : tolerated * least;
  target.is_worse = has_larger_error || covers_fewer;
  target.is_good = has_limit ? !(target.rmse > target.limit)
                             : !((has_larger_error && target.rmse > target.limit) ||
                                 (covers_fewer && target.covered < least_covered));
  for (CheckedLeaf& leaf : target.leaves) {
    leaf.is_worse = is_beyond_chance(leaf.probability) && leaf.rmse > rounding_share * (column.high - column.low);
  }
}

std::string why_not_evaluated(const std::vector<CheckedTarget>& targets, bool has_held_out) {
  Eigen::Index most = 0;
  for (const CheckedTarget& target : targets) most = std::max(most, target.rows);
  if (most == 0) return "no row has a value of the target";
  if (most < fewest_checked_rows) {
    return fmt::format("{} row{} a value of the target, {} are needed", most, most == 1 ? " has" : "s have",
                       fewest_checked_rows);
  }
  if (!has_held_out) {
    return fmt::format("the model's file has the errors of fewer than {} held-out rows, so that it promises nothing",
                       fewest_checked_rows);
  }
  return "";
}

// The verdict, once everything is measured.
TableCheck judged(TableCheck found, const std::vector<OutputColumn>& columns, const CheckOptions& options,
                  bool has_held_out) {
  correct(found);
  bool has_moved = false;
  bool is_good = true;
  for (std::size_t o = 0; o < columns.size(); ++o) {
    judge_target(found.targets[o], columns[o], options, o);
    has_moved =
        has_moved || found.targets[o].is_worse || std::ranges::any_of(found.targets[o].leaves, &CheckedLeaf::is_worse);
    is_good = is_good && found.targets[o].is_good;
  }
  for (CheckedInput& input : found.inputs) {
    input.has_moved = input.unknown > 0 || input.probability < options.level;
    has_moved = has_moved || input.has_moved;
  }
  found.reason = why_not_evaluated(found.targets, has_held_out || !options.limits.empty());
  found.verdict = !found.reason.empty() ? CheckVerdict::not_evaluated
                  : !is_good            ? CheckVerdict::no_longer_good
                  : has_moved           ? CheckVerdict::moved_within_limits
                                        : CheckVerdict::good;
  return found;
}

}  // namespace

std::string_view to_string(CheckVerdict verdict) {
  switch (verdict) {
    case CheckVerdict::good:
      return "good";
    case CheckVerdict::moved_within_limits:
      return "moved, within limits";
    case CheckVerdict::no_longer_good:
      return "no longer good";
    case CheckVerdict::not_evaluated:
      return "not evaluated";
  }
  throw std::invalid_argument("llmt::to_string: no verdict");
}

TableCheck check(const ModelWithIntervals& file, const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                 const Eigen::Ref<const Eigen::MatrixXd>& outputs, const CheckOptions& options) {
  const auto& [model, intervals] = file;
  check_arguments(inputs, outputs, model.outputs().size(), options);
  const Eigen::MatrixXd predicted = model.predict(inputs, options.max_threads);
  const Eigen::MatrixXd at = at_positions(model.inputs(), inputs);
  const std::vector<Eigen::Index> in_gap = rows_in_gaps(intervals.gaps(), inputs);
  const NewRows rows{at, in_gap, options.weights};
  const Eigen::MatrixXi leaf_of = model.leaf_of(inputs, options.max_threads);
  TableCheck found{.rows = inputs.rows(), .has_record = !intervals.record().empty()};
  Bounds bounds;
  bool has_held_out = !intervals.empty();
  for (std::size_t p = 0; p < model.partitions().size(); ++p) {
    for (const int output : model.partitions()[p].outputs) {
      const std::vector<PartOfOutput> parts = parts_of(intervals, output);
      JudgedTarget target = judged_target(model.outputs()[static_cast<std::size_t>(output)], parts, rows,
                                          outputs.col(output), predicted.col(output));
      has_held_out = has_held_out && std::ssize(target.held_out) >= fewest_checked_rows;
      if (bounds.lower.size() == 0 && has_bounds(parts)) {
        bounds = holding(intervals.predict(inputs, checked_level, options.max_threads, options.weights), predicted);
      }
      if (has_bounds(parts)) {
        target.lower = bounds.lower.col(output);
        target.upper = bounds.upper.col(output);
      }
      const auto& known = intervals.record().leaves;
      if (!known.empty() && std::ssize(known[static_cast<std::size_t>(output)]) == model.partitions()[p].num_leaves()) {
        target.leaf_of = leaf_of.col(static_cast<Eigen::Index>(p));
        target.leaves = known[static_cast<std::size_t>(output)];
      }
      found.targets.resize(model.outputs().size());
      found.targets[static_cast<std::size_t>(output)] = check_target(target);
    }
  }
  found.inputs = check_inputs(model.inputs(), used_inputs(model), inputs, at, intervals.record());
  const std::vector<Extrapolation> extrapolation = model.extrapolation(inputs, options.max_threads);
  for (Eigen::Index row = 0; row < inputs.rows(); ++row) {
    if (extrapolation[static_cast<std::size_t>(row)].distance > 0.0) found.outside.push_back(row);
  }
  return judged(std::move(found), model.outputs(), options, has_held_out);
}

TableCheck check(const BoostedModel& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                 const Eigen::Ref<const Eigen::MatrixXd>& outputs, const CheckOptions& options) {
  check_arguments(inputs, outputs, model.outputs().size(), options);
  const Eigen::MatrixXd predicted = model.predict(inputs, options.max_threads);
  const Eigen::MatrixXd at = with_empty_levels(model.inputs(), inputs);
  const std::vector<Eigen::Index> in_gap = rows_in_gaps(model.gaps(), inputs);
  const NewRows rows{at, in_gap, options.weights};
  TableCheck found{.rows = inputs.rows(), .has_record = !model.record().empty()};
  bool has_held_out = true;
  std::vector<JudgedTarget> targets;
  bool has_all_bounds = model.has_intervals();
  for (Eigen::Index o = 0; o < model.num_outputs(); ++o) {
    const auto output = static_cast<std::size_t>(o);
    const std::vector<PartOfOutput> parts = parts_of(model.sums()[output]);
    targets.push_back(judged_target(model.outputs()[output], parts, rows, outputs.col(o), predicted.col(o)));
    has_held_out = has_held_out && std::ssize(targets.back().held_out) >= fewest_checked_rows;
    has_all_bounds = has_all_bounds && has_bounds(parts);
  }
  Bounds bounds;
  if (has_all_bounds) bounds = model.intervals(inputs, checked_level, options.max_threads, options.weights);
  for (Eigen::Index o = 0; o < model.num_outputs(); ++o) {
    JudgedTarget& target = targets[static_cast<std::size_t>(o)];
    if (has_all_bounds) {
      target.lower = bounds.lower.col(o);
      target.upper = bounds.upper.col(o);
    }
    found.targets.push_back(check_target(target));
  }
  found.inputs = check_inputs(model.inputs(), used_inputs(model), inputs, at, model.record());
  const std::vector<double> distance = distance_outside(model, inputs);
  for (Eigen::Index row = 0; row < inputs.rows(); ++row) {
    if (distance[static_cast<std::size_t>(row)] > 0.0) found.outside.push_back(row);
  }
  return judged(std::move(found), model.outputs(), options, has_held_out);
}

}  // namespace llmt
