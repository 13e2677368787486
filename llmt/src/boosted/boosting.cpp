#include "boosted/boosting.hpp"

#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "boosted/symmetric_grower.hpp"

namespace llmt {
namespace {

// The rows that are learned from, then those that are held out.
bool are_in_order(const std::vector<int>& train, const std::vector<int>& held_out) {
  int next = 0;
  for (const std::vector<int>* rows : {&train, &held_out}) {
    for (const int row : *rows) {
      if (row != next++) return false;
    }
  }
  return true;
}

BinnedRows in_order(const BinnedRows& all, const std::vector<int>& rows) {
  BinnedRows result{.features = {}, .weights = all.weights(rows), .equal_weights = all.equal_weights};
  for (const BinnedFeature& feature : all.features) {
    BinnedFeature& some = result.features.emplace_back();
    some.feature = feature.feature;
    some.edges = feature.edges;
    some.last_cells = feature.last_cells;
    some.centres = feature.centres;
    some.has_missing = feature.has_missing;
    some.low = feature.low;
    some.high = feature.high;
    some.cells.reserve(rows.size());
    some.bins.reserve(rows.size());
    some.values.reserve(rows.size());
    for (const int row : rows) {
      some.cells.push_back(feature.cells[row]);
      some.bins.push_back(feature.bins[row]);
      some.values.push_back(feature.values[row]);
    }
  }
  return result;
}

double mean_square(const Eigen::Ref<const Eigen::VectorXd>& residuals,
                   const Eigen::Ref<const Eigen::VectorXd>& weights) {
  return residuals.cwiseAbs2().dot(weights) / weights.sum();
}

// Of the first `count` rows, the others are held out.
template <class Grower>
Rounds boost_first(Grower grower, const BinnedRows& rows, Eigen::VectorXd residuals, Eigen::Index count,
                   const std::vector<GrowingTree>& structures, const RoundOptions& options, Random& random,
                   Work& work) {
  Rounds result;
  result.base = residuals.head(count).dot(rows.weights.head(count)) / rows.weights.head(count).sum();
  result.rmse = std::numeric_limits<double>::quiet_NaN();
  residuals.array() -= result.base;
  const Eigen::Index num_held_out = residuals.size() - count;
  const auto held_out = residuals.tail(num_held_out);
  const auto rmse = [&] { return std::sqrt(mean_square(held_out, rows.weights.tail(num_held_out))); };
  double best = std::numeric_limits<double>::infinity();
  int best_round = 0;
  if (num_held_out > 0) {
    best = rmse();
    result.residuals = held_out;
    if (options.keep_path) result.path.push_back(held_out);
  }
  for (int round = 1; round <= options.most_rounds; ++round) {
    work.did(1.0 / options.most_rounds);
    result.trees.push_back(round <= std::ssize(structures) ? grower.estimate(structures[round - 1], residuals)
                                                           : grower.grow(residuals, random));
    grower.subtract_last(result.trees.back(), options.rate, residuals);
    if (num_held_out == 0) continue;
    if (options.keep_path) result.path.push_back(held_out);
    const double error = rmse();
    if (error < best * (1.0 - 1e-9)) {
      best = error;
      best_round = round;
      result.residuals = held_out;
    }
    if (round - best_round >= options.patience) break;
  }
  result.train_rmse = std::sqrt(mean_square(residuals.head(count), rows.weights.head(count)));
  if (num_held_out == 0) {
    result.residuals = residuals;
  } else {
    result.trees.resize(best_round);
    result.rmse = best;
  }
  return result;
}

}  // namespace

Rounds boost(const BinnedRows& rows, const Eigen::VectorXd& output, const std::vector<int>& train,
             const std::vector<int>& held_out, const std::vector<GrowingTree>& structures, const RoundOptions& options,
             Random& random, Work& work) {
  if (!are_in_order(train, held_out)) {
    std::vector<int> all = train;
    all.insert(all.end(), held_out.begin(), held_out.end());
    std::vector<int> first(all.size());
    std::iota(first.begin(), first.end(), 0);
    const std::vector<int> others(first.begin() + std::ssize(train), first.end());
    first.resize(train.size());
    return boost(in_order(rows, all), output(all), first, others, structures, options, random, work);
  }
  const Eigen::Index count = std::ssize(train);
  const Eigen::VectorXd residuals = output.head(count + std::ssize(held_out));
  if (options.tree.symmetric && options.tree.softness == 0.0) {
    SymmetricGrower grower(rows, count, options.tree, options.max_threads);
    return boost_first(std::move(grower), rows, residuals, count, structures, options, random, work);
  }
  TreeGrower grower(rows, count, options.tree, options.max_threads);
  return boost_first(std::move(grower), rows, residuals, count, structures, options, random, work);
}

}  // namespace llmt
