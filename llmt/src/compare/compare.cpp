#include "llmt/compare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <stdexcept>

#include "base/sum_over.hpp"
#include "data/equal_rows.hpp"
#include "data/given_rows.hpp"
#include "fit/pipeline.hpp"
#include "fit/plan/check_options.hpp"
#include "fit/prepare.hpp"
#include "fit/robust_weights.hpp"
#include "growth/rules/rule.hpp"
#include "llmt/crps.hpp"
#include "llmt/statistics.hpp"

namespace llmt {
namespace {

double seconds_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

Eigen::Index count_parameters(const Model& model) {
  Eigen::Index count = 0;
  for (const Partition& partition : model.partitions()) {
    count += partition.num_leaves() - 1;
    for (const Node& node : partition.nodes) {
      count += node.is_leaf() ? node.value.size() + (node.slope.array() != 0.0).count() : 0;
      // A direction, the length of which says nothing, and the half width of the gate.
      count += node.is_oblique() ? (node.direction.array() != 0.0).count() : 0;
    }
  }
  return count;
}

// One label per row where rows are repeats or copies of others; else empty.
std::vector<double> groups_of_repeats(const GivenRows& given) {
  std::vector<Eigen::Index> rows(given.inputs.values.rows());
  std::iota(rows.begin(), rows.end(), 0);
  const std::vector<int> group = find_equal_rows(given.inputs.values, rows, *given.numbers).group;
  return {group.begin(), group.end()};
}

bool is_least_squares(const Method& method) { return !method.boosted && method.options.max_leaves == 1; }

bool is_readable(const Method& method) {
  return !method.boosted && rule_of(method.options.rule).is_read_most_easily &&
         method.options.validity == ValidityChoice::crisp && method.options.terms == LocalTerms::linear;
}

void recommend(const std::vector<Method>& methods, ComparisonResult& result) {
  std::size_t best = 0;
  for (std::size_t m = 1; m < methods.size(); ++m) {
    if (result.methods[m].cv_rmse < result.methods[best].cv_rmse) {
      best = m;
    }
  }
  result.recommended = best;
  const auto ties = [&](std::size_t m) {
    const PairedDifference difference = paired_difference(result.methods[m].fold_rmse, result.methods[best].fold_rmse);
    return difference.mean <= difference.standard_error;
  };
  for (const auto& simple : {is_readable, is_least_squares}) {
    for (std::size_t m = 0; m < methods.size() && !is_least_squares(methods[best]); ++m) {
      if (m != best && simple(methods[m]) && ties(m)) {
        result.recommended = m;
      }
    }
  }
  const Comparison& taken = result.methods[result.recommended];
  if (result.recommended != best) {
    result.recommendation =
        fmt::format("Take {}: its held-out error is within one standard error of the best ({}), and it is simpler.",
                    taken.method, result.methods[best].method);
    return;
  }
  // The best of the others says how much the choice matters.
  std::size_t second = result.methods.size();
  for (std::size_t m = 0; m < methods.size(); ++m) {
    if (m != best && (second == result.methods.size() || result.methods[m].cv_rmse < result.methods[second].cv_rmse)) {
      second = m;
    }
  }
  result.recommendation = fmt::format("Take {}: it has the smallest held-out error", taken.method);
  if (second < result.methods.size()) {
    const double gain = 1.0 - taken.cv_rmse / result.methods[second].cv_rmse;
    result.recommendation += fmt::format(", {:.1f} % below the next ({})", 100.0 * gain, result.methods[second].method);
    if (ties(second)) {
      result.recommendation += ", which differs by less than one standard error over the folds";
    }
  }
  result.recommendation += ".";
}

// The weights that rows lose by the loss, found once for all methods: their errors are then of the same rows. Empty if
// no method has that loss.
Eigen::VectorXd loss_weights_of(const GivenRows& given, const std::vector<Method>& methods, Work& work) {
  const auto robust =
      std::ranges::find_if(methods, [](const Method& method) { return method.options.loss == Loss::tukey; });
  if (robust == methods.end()) return {};
  check_options(robust->options, given.inputs.values.cols());
  constexpr double share_of_loss = 0.05;
  Work part(work, share_of_loss);
  return robust_weights(checked(given, robust->options), robust->options, part);
}

FitResult fit_part(const GivenRows& rows, const FitOptions& options, double share, Work& work) {
  Work part(work, share);
  FitResult result = fit(prepare(rows, options, part), part);
  part.finish();
  return result;
}

// The same of a sum of trees.
BoostedModel boost_part(const GivenRows& rows, const Method& method, double share, Work& work) {
  TrainingData data{.inputs = rows.inputs.values, .outputs = rows.outputs.values, .weights = rows.weights};
  data.groups = rows.groups;
  data.categorical_inputs = rows.categorical;
  Work part(work, share);
  return fit_boosted(data, *method.boosted, part.progress()).model;
}

constexpr double level_of_coverage = 0.9;
constexpr int quantiles_of_crps = 20;

// What a method says of rows that it has not seen.
struct Forecast {
  Eigen::MatrixXd predictions;
  std::vector<Bounds> bounds;  // at the levels of the quantiles and, last, that of coverage; empty: too few rows
};

std::vector<double> levels_of_forecast() {
  std::vector<double> levels = levels_of_quantiles(crps_probabilities(quantiles_of_crps));
  levels.push_back(level_of_coverage);
  return levels;
}

Eigen::Index rows_of(const Intervals& intervals) {
  Eigen::Index rows = 0;
  for (const HeldOutPart& part : intervals.parts()) rows += part.residuals.rows() + part.incomplete.rows();
  return rows;
}

Eigen::Index rows_of(const BoostedModel& model) {
  Eigen::Index rows = 0;
  for (const SumResiduals& part : model.sums().front().held_out) rows += std::ssize(part.residuals);
  return rows;
}

// What the method, fitted to some rows, says of others. `weights`: of these; empty: none.
Forecast forecast(const GivenRows& fitted, const Method& method, const Eigen::MatrixXd& inputs,
                  const Eigen::VectorXd& weights, double share, Work& work) {
  Forecast result;
  if (method.boosted) {
    const BoostedModel model = boost_part(fitted, method, share, work);
    result.predictions = model.predict(inputs);
    if (rows_of(model) >= fewest_rows_of_crps)
      result.bounds = model.intervals(inputs, levels_of_forecast(), 1, weights);
    return result;
  }
  FitOptions options = method.options;
  options.intervals = true;
  const FitResult fit = fit_part(fitted, options, share, work);
  result.predictions = fit.model.predict(inputs);
  if (rows_of(fit.intervals) < fewest_rows_of_crps) return result;
  for (Bounds& bounds : fit.intervals.predict(inputs, levels_of_forecast(), 1, weights)) {
    result.bounds.push_back(holding(std::move(bounds), result.predictions));
  }
  return result;
}

// The coverage and the CRPS of some rows, added to those of others.
struct IntervalMeans {
  WeightedMean inside;
  WeightedMean score;
  bool has_all = true;  // whether there are intervals of all rows

  void add(const Forecast& forecast, const Eigen::VectorXd& observed, const Eigen::VectorXd& weights) {
    has_all = has_all && !forecast.bounds.empty();
    if (!has_all) return;
    std::vector<Bounds> bounds = forecast.bounds;
    const Bounds of_coverage = std::move(bounds.back());
    bounds.pop_back();
    const Eigen::VectorXd scores =
        crps(quantiles_from(bounds, forecast.predictions, crps_probabilities(quantiles_of_crps)).front(), observed);
    for (Eigen::Index i = 0; i < observed.size(); ++i) {
      const bool holds = of_coverage.lower(i, 0) <= observed(i) && observed(i) <= of_coverage.upper(i, 0);
      inside.add(holds ? 1.0 : 0.0, weights(i));
      score.add(scores(i), weights(i));
    }
  }
};

// The weights of some rows, with 1 in the place of 0, a weight that no interval has and that no error counts.
Eigen::VectorXd positive_weights(const Eigen::VectorXd& weights, const std::vector<Eigen::Index>& rows) {
  if (weights.size() == 0) return {};
  const Eigen::VectorXd some = weights(rows);
  return (some.array() > 0.0).select(some, 1.0);
}

// The held-out errors of a method: fills in fold_rmse, cv_rmse, spread, coverage and crps. `share`: of a fit in the
// work.
void judge_on_folds(const GivenRows& given, const Method& method, const Eigen::VectorXd& error_weights,
                    const std::vector<Fold>& folds, double share, Work& work, Comparison& entry) {
  WeightedMean all;
  IntervalMeans of_intervals;
  entry.fold_rmse.resize(std::ssize(folds));
  for (std::size_t f = 0; f < folds.size(); ++f) {
    const Fold& fold = folds[f];
    const Forecast of_fold =
        forecast(rows_at(given, fold.train), method, given.inputs.values(fold.held_out, Eigen::all),
                 positive_weights(given.weights, fold.held_out), share, work);
    const Eigen::VectorXd observed = given.outputs.values(fold.held_out, 0);
    const Eigen::VectorXd error = of_fold.predictions.col(0) - observed;
    const Eigen::VectorXd weights = error_weights(fold.held_out);
    of_intervals.add(of_fold, observed, weights);
    const auto add = [&](RowSpan block, WeightedMean& squares) {
      for (Eigen::Index i = block.begin; i < block.end; ++i) squares.add(error(i) * error(i), weights(i));
    };
    const WeightedMean squares = sum_over(RowBlocks{error.size()}, 1, WeightedMean{}, add);
    all += squares;
    entry.fold_rmse(f) = std::sqrt(squares.value());
  }
  entry.cv_rmse = std::sqrt(all.value());
  entry.spread = spread_of(entry.fold_rmse);
  constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  entry.coverage = of_intervals.has_all ? of_intervals.inside.value() : unknown;
  entry.crps = of_intervals.has_all ? of_intervals.score.value() : unknown;
}

// The time of a prediction of a million rows.
template <class AnyModel>
double predict_seconds(const AnyModel& model, const Eigen::MatrixXd& inputs, int threads) {
  return seconds_of([&] { model.predict(inputs, threads); }) * 1e6 / static_cast<double>(inputs.rows());
}

// The model of all rows: its size, its largest jump and its times.
void describe_model(const GivenRows& given, const Method& method, double share, Work& work, Comparison& entry) {
  const Eigen::MatrixXd inputs = given.inputs.values;
  if (method.boosted) {
    std::vector<BoostedModel> all;
    entry.fit_seconds = seconds_of([&] { all.push_back(boost_part(given, method, share, work)); });
    entry.predict_seconds = predict_seconds(all.front(), inputs, method.boosted->max_threads);
    const BoostedSize size = size_of(all.front());
    entry.is_sum = true;
    entry.trees = size.trees;
    entry.leaves = size.leaves;
    entry.parameters = size.parameters;
    entry.largest_jump = std::numeric_limits<double>::quiet_NaN();
    return;
  }
  std::vector<FitResult> all;
  entry.fit_seconds = seconds_of([&] { all.push_back(fit_part(given, method.options, share, work)); });
  const Model& model = all.front().model;
  entry.predict_seconds = predict_seconds(model, inputs, method.options.max_threads);
  entry.leaves = model.partitions().front().num_leaves();
  entry.parameters = count_parameters(model);
  entry.largest_jump = largest_jump(model, inputs);
}

ComparisonResult compare_rows(GivenRows given, const std::vector<Method>& methods, const CompareOptions& options) {
  const Eigen::Index rows = given.inputs.values.rows();
  const Eigen::Ref<const Eigen::MatrixXd>& output = given.outputs.values;
  if (!given.held_out.empty()) {
    throw std::invalid_argument("llmt::compare: held_out is for fit(); methods are compared on CompareOptions::folds");
  }
  if (std::ranges::any_of(methods, [](const Method& m) { return m.boosted && m.options.loss == Loss::tukey; })) {
    throw std::invalid_argument("llmt::compare: a sum of trees has no Loss::tukey; compare trees alone");
  }
  if (methods.empty()) throw std::invalid_argument("llmt::compare: there is no method");
  if (output.cols() != 1 || output.rows() != rows) {
    throw std::invalid_argument(fmt::format("llmt::compare: output is {} x {}, one column and {} rows are needed",
                                            output.rows(), output.cols(), rows));
  }
  FoldOptions fold_options = options.folds;
  fold_options.count = static_cast<int>(std::min<Eigen::Index>(fold_options.count, rows));
  std::vector<double> groups = given.groups;
  if (groups.empty()) {
    std::vector<Eigen::Index> all(rows);
    std::iota(all.begin(), all.end(), 0);
    given.numbers = number_rows(given.inputs.values, output, all);
    groups = groups_of_repeats(given);
    if (!groups.empty()) {
      const Eigen::Index count = std::ssize(std::set<double>(groups.begin(), groups.end()));
      fold_options.count = static_cast<int>(std::min<Eigen::Index>(fold_options.count, count));
    }
  }
  const std::vector<Fold> folds = make_folds(rows, fold_options, groups);
  ComparisonResult result;
  Work work(options.progress);
  result.loss_weights = loss_weights_of(given, methods, work);
  const Eigen::VectorXd error_weights = result.loss_weights.size() > 0
                                            ? without_outliers(given.weights, result.loss_weights)
                                        : given.weights.size() > 0 ? given.weights
                                                                   : Eigen::VectorXd::Ones(rows).eval();
  const double share = work.left() / static_cast<double>(methods.size() * (folds.size() + 1));
  for (const Method& method : methods) {
    work.begin(method.name);
    Comparison entry{.method = method.name};
    judge_on_folds(given, method, error_weights, folds, share, work, entry);
    describe_model(given, method, share, work, entry);
    result.methods.push_back(std::move(entry));
  }
  recommend(methods, result);
  work.finish();
  return result;
}

}  // namespace

ComparisonResult compare(const TrainingData& data, const std::vector<Method>& methods, const CompareOptions& options) {
  return compare_rows(settled(given_rows(data), 1), methods, options);
}

ComparisonResult compare(const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                         const Eigen::Ref<const Eigen::MatrixXd>& output, const std::vector<Method>& methods,
                         const CompareOptions& options) {
  return compare_rows(settled({.inputs = {inputs}, .outputs = {output}}, 1), methods, options);
}

}  // namespace llmt
