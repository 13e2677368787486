#include "fit/output_range.hpp"

#include <algorithm>
#include <limits>
#include <tuple>

#include "base/parallel.hpp"
#include "partition/evaluator.hpp"
#include "selection/fold_errors.hpp"
#include "selection/selection.hpp"

namespace llmt {
namespace {

// A clamp can only help on rows within the range, and what lies beyond it no model that is clamped will ever say. A
// gain below this part of the error is not worth that.
constexpr double least_gain = 0.01;

// Sums of weighted squared errors of one fold, one entry an output.
struct SquaredErrors {
  Eigen::VectorXd without;
  Eigen::VectorXd with;

  static auto fields(auto& self) { return std::tie(self.without, self.with); }
};

Eigen::MatrixXd range_of(const std::vector<int>& outputs, const TrainingRows& training) {
  Eigen::MatrixXd range(std::ssize(outputs), 2);
  for (std::size_t o = 0; o < outputs.size(); ++o) {
    const OutputColumn& column = training.output_columns[outputs[o]];
    range.row(o) << column.low, column.high;
  }
  return range;
}

SquaredErrors errors_of(const Partition& partition, const FoldRows& fold) {
  const Eigen::Index outputs = std::ssize(partition.outputs);
  const Evaluator evaluator(partition, fold.training.columns, std::ssize(fold.training.regressors));
  const Eigen::ArrayX2d range = range_of(partition.outputs, fold.training).array();
  const auto add = [&](const Chunk& chunk, SquaredErrors& errors) {
    std::vector<Activation> active;
    Eigen::VectorXd values(outputs);
    for (Eigen::Index row = 0; row < chunk.count(); ++row) {
      evaluator.activate(chunk.inputs.row(row).data(), active);
      evaluator.combine(active, chunk.deviations.row(row).data(), values.data());
      const Eigen::VectorXd clamped = values.array().max(range.col(0)).min(range.col(1));
      const auto measured = chunk.outputs.row(row).transpose();
      errors.without += chunk.weights(row) * (measured - values).cwiseAbs2();
      errors.with += chunk.weights(row) * (measured - clamped).cwiseAbs2();
    }
  };
  SquaredErrors zero{Eigen::VectorXd::Zero(outputs), Eigen::VectorXd::Zero(outputs)};
  return sum_over(fold.held_out, partition.outputs, 1, std::move(zero), add);
}

// The errors of one output in all folds.
std::vector<double> of_output(const std::vector<SquaredErrors>& errors, Eigen::VectorXd SquaredErrors::*kind,
                              Eigen::Index output) {
  std::vector<double> result;
  for (const SquaredErrors& of_fold : errors) result.push_back((of_fold.*kind)(output));
  return result;
}

bool is_worth_it(const CandidateError& without, const CandidateError& with) {
  return with.rmse < (1.0 - least_gain) * without.rmse && is_beyond_chance(without, with);
}

}  // namespace

std::vector<RangeGuard> guard_output_range(const std::vector<FoldRows>& folds, const Eigen::VectorXd& weights,
                                           int max_threads, std::vector<Partition>& of_folds, CandidateError& chosen) {
  std::vector<FoldRows> judging;
  for (const FoldRows& fold : folds) judging.push_back({fold.training, subsample(fold.held_out, most_held_out_rows)});
  std::vector<SquaredErrors> errors(folds.size());
  parallel_for(std::ssize(folds), max_threads, [&](Eigen::Index f) { errors[f] = errors_of(of_folds[f], judging[f]); });
  const FoldErrors of_one(judging, 1);
  std::vector<RangeGuard> guards;
  for (Eigen::Index o = 0; o < weights.size(); ++o) {
    const CandidateError without = of_one(chosen.candidate, of_output(errors, &SquaredErrors::without, o));
    const CandidateError with = of_one(chosen.candidate, of_output(errors, &SquaredErrors::with, o));
    guards.push_back({is_worth_it(without, with), without.rmse, with.rmse});
  }
  if (std::ranges::none_of(guards, &RangeGuard::taken)) return guards;
  std::vector<double> sums(folds.size(), 0.0);
  for (std::size_t f = 0; f < folds.size(); ++f) {
    for (Eigen::Index o = 0; o < weights.size(); ++o) {
      sums[f] += weights(o) * (guards[o].taken ? errors[f].with : errors[f].without)(o);
    }
    of_folds[f].output_range = output_range(guards, of_folds[f].outputs, folds[f].training);
  }
  chosen = FoldErrors(judging, weights.size())(chosen.candidate, sums);
  return guards;
}

Eigen::MatrixXd output_range(const std::vector<RangeGuard>& guards, const std::vector<int>& outputs,
                             const TrainingRows& training) {
  if (std::ranges::none_of(guards, &RangeGuard::taken)) return {};
  constexpr double open = std::numeric_limits<double>::infinity();
  Eigen::MatrixXd range = range_of(outputs, training);
  for (std::size_t o = 0; o < guards.size(); ++o) {
    if (!guards[o].taken) range.row(o) << -open, open;
  }
  return range;
}

}  // namespace llmt
