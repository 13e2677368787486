#include "llmt/compare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <set>
#include <stdexcept>

#include "base/sum_over.hpp"
#include "data/equal_rows.hpp"
#include "fit/check_options.hpp"
#include "fit/robust_weights.hpp"
#include "growth/rules/rule.hpp"
#include "llmt/statistics.hpp"

namespace llmt {
namespace {

double seconds_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Rows of the options that speak of single rows, for a part of them.
FitOptions for_rows(FitOptions options, const std::vector<Eigen::Index>& rows) {
  if (options.weights.size() > 0) {
    options.weights = Eigen::VectorXd(options.weights(rows));
  }
  options.folds.groups = {};
  return options;
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
std::vector<double> groups_of_repeats(const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                                      const Eigen::Ref<const Eigen::MatrixXd>& output) {
  std::vector<Eigen::Index> rows(inputs.rows());
  std::iota(rows.begin(), rows.end(), 0);
  const std::vector<int> group = find_equal_rows(inputs, rows, number_rows(inputs, output, rows)).group;
  return {group.begin(), group.end()};
}

bool is_least_squares(const Method& method) { return method.options.max_leaves == 1; }

bool is_readable(const Method& method) {
  return rule_of(method.options.rule).is_read_most_easily && method.options.validity == ValidityChoice::crisp &&
         method.options.terms == LocalTerms::linear;
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
Eigen::VectorXd loss_weights_of(const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                                const Eigen::Ref<const Eigen::MatrixXd>& output, const std::vector<Method>& methods,
                                Work& work) {
  const auto robust =
      std::ranges::find_if(methods, [](const Method& method) { return method.options.loss == Loss::tukey; });
  if (robust == methods.end()) return {};
  check_options(robust->options, inputs.cols());
  constexpr double share_of_loss = 0.05;
  Work part(work, share_of_loss);
  return robust_weights(given_rows(inputs, output, robust->options), robust->options, part);
}

// The weights of rows in the errors of a method.
Eigen::VectorXd error_weights_of(const Method& method, const Eigen::VectorXd& loss_weights, Eigen::Index rows) {
  if (loss_weights.size() > 0) return without_outliers(method.options.weights, loss_weights);
  if (method.options.weights.size() > 0) return method.options.weights;
  return Eigen::VectorXd::Ones(rows);
}

// The held-out errors of a method: fills in fold_rmse, cv_rmse and spread. `share`: of a fit in the work.
void judge_on_folds(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& output,
                    const Method& method, const Eigen::VectorXd& error_weights, const std::vector<Fold>& folds,
                    double share, Work& work, Comparison& entry) {
  WeightedMean all;
  entry.fold_rmse.resize(std::ssize(folds));
  for (std::size_t f = 0; f < folds.size(); ++f) {
    const Fold& fold = folds[f];
    Work part(work, share);
    FitOptions options = for_rows(method.options, fold.train);
    options.progress = part.progress();
    const FitResult fitted = fit(inputs(fold.train, Eigen::all), output(fold.train, Eigen::all), options);
    const Eigen::VectorXd error =
        fitted.model.predict(inputs(fold.held_out, Eigen::all)) - Eigen::MatrixXd(output(fold.held_out, Eigen::all));
    const Eigen::VectorXd weights = error_weights(fold.held_out);
    const auto add = [&](RowSpan block, WeightedMean& squares) {
      for (Eigen::Index i = block.begin; i < block.end; ++i) squares.add(error(i) * error(i), weights(i));
    };
    const WeightedMean squares = sum_over(RowBlocks{error.size()}, 1, WeightedMean{}, add);
    all += squares;
    entry.fold_rmse(f) = std::sqrt(squares.value());
  }
  entry.cv_rmse = std::sqrt(all.value());
  entry.spread = spread_of(entry.fold_rmse);
}

// The model of all rows: its size, its largest jump and its times.
void describe_model(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& output,
                    const Method& method, double share, Work& work, Comparison& entry) {
  Work part(work, share);
  FitOptions options = method.options;
  options.progress = part.progress();
  std::vector<FitResult> all;
  entry.fit_seconds = seconds_of([&] { all.push_back(fit(inputs, output, options)); });
  const Model& model = all.front().model;
  entry.predict_seconds =
      seconds_of([&] { model.predict(inputs, method.options.max_threads); }) * 1e6 / static_cast<double>(inputs.rows());
  entry.leaves = model.partitions().front().num_leaves();
  entry.parameters = count_parameters(model);
  entry.largest_jump = largest_jump(model, inputs);
}

}  // namespace

ComparisonResult compare(const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                         const Eigen::Ref<const Eigen::MatrixXd>& output, const std::vector<Method>& methods,
                         const CompareOptions& options) {
  if (methods.empty()) throw std::invalid_argument("llmt::compare: there is no method");
  if (output.cols() != 1 || output.rows() != inputs.rows()) {
    throw std::invalid_argument(fmt::format("llmt::compare: output is {} x {}, one column and {} rows are needed",
                                            output.rows(), output.cols(), inputs.rows()));
  }
  FoldOptions fold_options = options.folds;
  fold_options.count = static_cast<int>(std::min<Eigen::Index>(fold_options.count, inputs.rows()));
  const std::vector<double> repeats =
      fold_options.groups.empty() ? groups_of_repeats(inputs, output) : std::vector<double>{};
  if (!repeats.empty()) {
    fold_options.groups = repeats;
    const Eigen::Index groups = std::ssize(std::set<double>(repeats.begin(), repeats.end()));
    fold_options.count = static_cast<int>(std::min<Eigen::Index>(fold_options.count, groups));
  }
  const std::vector<Fold> folds = make_folds(inputs.rows(), fold_options);
  ComparisonResult result;
  Work work(options.progress);
  result.loss_weights = loss_weights_of(inputs, output, methods, work);
  const double share = work.left() / static_cast<double>(methods.size() * (folds.size() + 1));
  for (const Method& method : methods) {
    work.begin(method.name);
    Comparison entry{.method = method.name};
    judge_on_folds(inputs, output, method, error_weights_of(method, result.loss_weights, inputs.rows()), folds, share,
                   work, entry);
    describe_model(inputs, output, method, share, work, entry);
    result.methods.push_back(std::move(entry));
  }
  recommend(methods, result);
  work.finish();
  return result;
}

}  // namespace llmt
