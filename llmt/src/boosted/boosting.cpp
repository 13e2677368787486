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

template <class T>
std::vector<T> at(const std::vector<T>& values, const std::vector<int>& rows) {
  std::vector<T> result;
  result.reserve(rows.size());
  for (const int row : rows) result.push_back(values[row]);
  return result;
}

BinnedRows in_order(const BinnedRows& all, const std::vector<int>& rows) {
  BinnedRows result{.weights = all.weights(rows), .equal_weights = all.equal_weights};
  for (std::size_t k = 0; k < all.features.size(); ++k) {
    const BinnedFeature& feature = all.features[k];
    result.features.push_back({.feature = feature.feature,
                               .edges = feature.edges,
                               .last_cells = feature.last_cells,
                               .centres = feature.centres,
                               .cells = at(feature.cells, rows),
                               .bins = at(feature.bins, rows),
                               .values = at(feature.values, rows),
                               .has_missing = feature.has_missing,
                               .low = feature.low,
                               .high = feature.high});
  }
  return result;
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
  const auto held_out_weights = rows.weights.tail(num_held_out);
  double best = std::numeric_limits<double>::infinity();
  int best_round = 0;
  if (num_held_out > 0) {
    best = rmse_of(held_out, held_out_weights);
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
    const double error = rmse_of(held_out, held_out_weights);
    if (error < best * (1.0 - 1e-9)) {
      best = error;
      best_round = round;
      result.residuals = held_out;
    }
    if (round - best_round >= options.patience) break;
  }
  result.train_rmse = rmse_of(residuals.head(count), rows.weights.head(count));
  if (num_held_out == 0) {
    result.residuals = residuals;
  } else {
    result.trees.resize(best_round);
    result.rmse = best;
  }
  return result;
}

void multiply(BoostedTree& tree, double by) {
  for (BoostedLeaf& leaf : tree.leaves) {
    leaf.constant *= by;
    leaf.low *= by;
    leaf.high *= by;
    for (double& slope : leaf.slopes) slope *= by;
  }
}

}  // namespace

double rmse_of(const Eigen::Ref<const Eigen::VectorXd>& residuals, const Eigen::Ref<const Eigen::VectorXd>& weights) {
  return std::sqrt(residuals.cwiseAbs2().dot(weights) / weights.sum());
}

Rounds boost(const BinnedRows& rows, const Eigen::VectorXd& output, const std::vector<int>& train,
             const std::vector<int>& held_out, const std::vector<GrowingTree>& structures, const RoundOptions& options,
             Random& random, Work& work) {
  if (!are_in_order(train, held_out)) {
    std::vector<int> all = train;
    all.insert(all.end(), held_out.begin(), held_out.end());
    std::vector<int> first = all_rows(std::ssize(all));
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

BoostedSum sum_of(const std::vector<SumPart>& members, const BinnedRows& rows, double mean, double scale) {
  BoostedSum sum{.base = mean, .rate = members.front().rate, .features = {}, .trees = {}};
  for (std::size_t k = 0; k < rows.features.size(); ++k) sum.features.push_back(rows.features[k].feature);
  for (const SumPart& part : members) {
    sum.base += scale * part.share * part.rounds.base;
    const auto add = [&](BoostedTree tree, double rate) {
      multiply(tree, scale * (part.share * rate / sum.rate));
      sum.trees.push_back(std::move(tree));
    };
    for (const BoostedTree& tree : part.start) add(tree, 1.0);
    for (const GrowingTree& tree : part.rounds.trees) add(finished(tree, rows), part.rate);
  }
  return sum;
}

}  // namespace llmt
