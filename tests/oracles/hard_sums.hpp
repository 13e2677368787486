// Sums of one tree that ask much of whoever predicts and explains them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "llmt/boosted_explain.hpp"
#include "llmt/boosted_model.hpp"

namespace oracle {

/// A chain of splits.
struct ChainOfSum {
  int splits = 12;
  int inputs = 12;  ///< taken in turn
  double half_width = 10.0;
  double smallest_share = 0.0;
  bool to_the_left = true;  ///< the side on which the next split lies
  int together = 1;         ///< inputs, one after the other, whose sum a split is on; factors 1, 1, -1/2, -1/3, ...
  double slope = 0.0;       ///< of two inputs in each leaf
  double limit = 1.0;       ///< of a leaf's values, on either side
};

/// Inputs have the centre 0 and the deviation 1, so that z = x; the thresholds are -0.2 ... 0.2.
inline llmt::BoostedModel chain_of_sum(const ChainOfSum& chain) {
  std::vector<llmt::InputColumn> inputs;
  llmt::BoostedSum sum{.base = 0.5, .rate = 0.1, .features = {}, .trees = {}};
  for (int j = 0; j < chain.inputs; ++j) {
    inputs.push_back({.name = "i" + std::to_string(j), .low = -1.0, .high = 1.0});
    llmt::BoostedFeature feature{.inputs = {}, .factors = {}};
    for (int k = 0; k < chain.together; ++k) {
      feature.inputs.push_back((j + k) % chain.inputs);
      feature.factors.push_back(k < 2 ? 1.0 : -1.0 / k);
    }
    sum.features.push_back(std::move(feature));
  }
  llmt::BoostedTree tree{.splits = {}, .leaves = {}, .smallest_share = chain.smallest_share};
  for (int k = 0; k < chain.splits; ++k) {
    const int next = k + 1 < chain.splits ? k + 1 : -1 - chain.splits;
    tree.splits.push_back({.feature = k % chain.inputs,
                           .threshold = 0.1 * (k % 5 - 2),
                           .half_width = chain.half_width,
                           .missing_left = k % 3 == 0 ? 1.0 : 0.0,
                           .left = chain.to_the_left ? next : -1 - k,
                           .right = chain.to_the_left ? -1 - k : next});
  }
  for (int k = 0; k <= chain.splits; ++k) {
    llmt::BoostedLeaf leaf{.constant = 0.3 * (k % 7) - 0.9, .low = -chain.limit, .high = chain.limit};
    if (chain.slope != 0.0) {
      leaf.features = {k % chain.inputs, (k + 1) % chain.inputs};
      leaf.slopes = {chain.slope, -2.0 * chain.slope};
    }
    tree.leaves.push_back(leaf);
  }
  sum.trees.push_back(std::move(tree));
  return {inputs, {{.name = "y", .low = 0.0, .high = 1.0}}, std::vector<double>(chain.inputs, 1.0), {sum}};
}

/// A leaf at whose limits all inputs meet, each of which changes it by 1; from 13 inputs on some are in pairs. It is
/// known when 7 inputs are of the row or inputs - 6 of the background: after C(inputs + 1, 7) - 1 trials of an input.
inline llmt::BoostedModel counting_leaf(int inputs) {
  std::vector<llmt::InputColumn> columns;
  for (int j = 0; j < inputs; ++j) columns.push_back({.name = "i" + std::to_string(j), .low = 0.0, .high = 1.0});
  llmt::BoostedSum sum{.base = 0.0, .rate = 1.0, .features = {}, .trees = {{}}};
  llmt::BoostedLeaf leaf{.constant = 0.0, .low = 6.4, .high = 6.6};
  for (int j = 0; j < inputs;) {
    const bool is_pair = j < 2 * (inputs - llmt::most_leaf_slopes);
    if (is_pair) {
      sum.features.push_back({.inputs = {j, j + 1}, .factors = {1.0, 1.0}});
    } else {
      sum.features.push_back({.inputs = {j}});
    }
    leaf.features.push_back(static_cast<int>(leaf.features.size()));
    leaf.slopes.push_back(1.0);
    j += is_pair ? 2 : 1;
  }
  sum.trees[0].leaves.push_back(leaf);
  return {columns, {{.name = "y"}}, std::vector<double>(inputs, 1.0), {sum}};
}

/// Explains the largest such leaf of 12 inputs or more that needs no more trials.
inline void explain_counting_leaf(std::int64_t most_trials) {
  int inputs = 12;
  const auto trials_of_next = [&](std::int64_t trials) { return (trials + 1) * (inputs + 2) / (inputs - 5) - 1; };
  for (std::int64_t trials = 1715; trials_of_next(trials) <= most_trials; ++inputs) trials = trials_of_next(trials);
  llmt::attribute(counting_leaf(inputs), Eigen::VectorXd::Ones(inputs), Eigen::MatrixXd::Zero(1, inputs));
}

/// A leaf with so many slopes of one input.
inline llmt::BoostedModel leaf_of_slopes(std::int64_t slopes) {
  llmt::BoostedSum sum;
  sum.features = {{.inputs = {0}}};
  llmt::BoostedLeaf leaf;
  leaf.features.assign(slopes, 0);
  leaf.slopes.assign(slopes, 1.0);
  sum.trees = {{.splits = {}, .leaves = {leaf}}};
  return {{{.name = "a", .low = 0.0, .high = 1.0}}, {{.name = "y", .low = 0.0, .high = 1.0}}, {1.0}, {sum}};
}

}  // namespace oracle
