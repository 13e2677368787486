#include "boosted/boosting.hpp"

#include <cmath>
#include <limits>

#include "base/parallel.hpp"
#include "base/sum_over.hpp"

namespace llmt {
namespace {

double weighted_mean(const Eigen::VectorXd& values, const Eigen::VectorXd& weights, const std::vector<int>& rows) {
  double sum = 0.0;
  double weight = 0.0;
  for (const int row : rows) {
    sum += weights(row) * values(row);
    weight += weights(row);
  }
  return sum / weight;
}

double rmse_of(const Eigen::VectorXd& residuals, const Eigen::VectorXd& weights, const std::vector<int>& rows) {
  return std::sqrt(weighted_mean(residuals.array().square(), weights, rows));
}

}  // namespace

Rounds boost(const BinnedRows& rows, const Eigen::VectorXd& output, const std::vector<int>& train,
             const std::vector<int>& held_out, const std::vector<GrowingTree>& structures, const RoundOptions& options,
             Random& random, Work& work) {
  Rounds result;
  result.base = weighted_mean(output, rows.weights, train);
  result.rmse = std::numeric_limits<double>::quiet_NaN();
  Eigen::VectorXd residuals = output.array() - result.base;
  TreeGrower grower(rows, train, options.tree, options.max_threads);
  double best = std::numeric_limits<double>::infinity();
  int best_round = 0;
  if (!held_out.empty()) {
    best = rmse_of(residuals, rows.weights, held_out);
    result.residuals = residuals(held_out);
    if (options.keep_path) result.path.push_back(result.residuals);
  }
  for (int round = 1; round <= options.most_rounds; ++round) {
    work.did(1.0 / options.most_rounds);
    result.trees.push_back(round <= std::ssize(structures) ? grower.estimate(structures[round - 1], residuals)
                                                           : grower.grow(residuals, random));
    const GrowingTree& tree = result.trees.back();
    grower.subtract_last(tree, options.rate, residuals);
    if (held_out.empty()) continue;
    const RowBlocks blocks{std::ssize(held_out)};
    parallel_for(blocks.count(), options.max_threads, [&](Eigen::Index block) {
      for (Eigen::Index k = blocks[block].begin; k < blocks[block].end; ++k) {
        residuals(held_out[k]) -= options.rate * value_at(tree, rows, held_out[k]);
      }
    });
    if (options.keep_path) result.path.push_back(residuals(held_out));
    const double error = rmse_of(residuals, rows.weights, held_out);
    if (error < best * (1.0 - 1e-9)) {
      best = error;
      best_round = round;
      result.residuals = residuals(held_out);
    }
    if (round - best_round >= options.patience) break;
  }
  result.train_rmse = rmse_of(residuals, rows.weights, train);
  if (held_out.empty()) {
    result.residuals = residuals(train);
  } else {
    result.trees.resize(best_round);
    result.rmse = best;
  }
  return result;
}

}  // namespace llmt
