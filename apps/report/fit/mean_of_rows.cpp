#include "report/fit/mean_of_rows.hpp"

#include <cmath>
#include <limits>

#include "llmt/statistics.hpp"

namespace llmt::report {

ErrorOfMean error_of_mean(const Eigen::Ref<const Eigen::VectorXd>& output, const Eigen::VectorXd& weights,
                          const std::vector<std::vector<Eigen::Index>>& held_out) {
  const Eigen::VectorXd w = weights.size() > 0 ? weights : Eigen::VectorXd::Ones(output.size()).eval();
  const double all = w.sum();
  const double sum = w.dot(output);
  ErrorOfMean error{.rmse = std::numeric_limits<double>::quiet_NaN(),
                    .train = std::sqrt((w.array() * (output.array() - sum / all).square()).sum() / all)};
  double squares = 0.0;
  double counted = 0.0;
  std::vector<double> of_folds;
  for (const std::vector<Eigen::Index>& rows : held_out) {
    const double here = w(rows).sum();
    if (!(here > 0.0) || !(all - here > 0.0)) continue;
    const double mean = (sum - w(rows).dot(output(rows))) / (all - here);
    const double square = (w(rows).array() * (output(rows).array() - mean).square()).sum();
    squares += square;
    counted += here;
    of_folds.push_back(std::sqrt(square / here));
  }
  if (of_folds.empty()) return error;
  error.rmse = std::sqrt(squares / counted);
  error.spread = llmt::spread_of(Eigen::Map<const Eigen::VectorXd>(of_folds.data(), std::ssize(of_folds)).eval());
  return error;
}

Eigen::VectorXd counted_weights(const FitRun& run, const FitResult& result) {
  Eigen::VectorXd weights = run.rows.weights;
  const Eigen::VectorXd& loss = result.summary.loss_weights;
  if (loss.size() > 0) {
    if (weights.size() == 0) weights = Eigen::VectorXd::Ones(loss.size());
    weights = (loss.array() > 0.0).select(weights, 0.0);
  }
  return weights;
}

ErrorOfMean error_of_mean(const FitRun& run, const FitResult& result, Eigen::Index output) {
  return error_of_mean(run.rows.outputs.col(output), counted_weights(run, result), result.summary.held_out);
}

}  // namespace llmt::report
