// Sums of random trees: all that a fit can make of them, and more.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "llmt/boosted_model.hpp"
#include "llmt/random.hpp"

namespace random_boosted {

inline constexpr double no_value = std::numeric_limits<double>::quiet_NaN();

struct Kind {
  int trees = 4;
  int leaves = 9;
  bool soft = true;
  double limit = 1.0;   ///< of a leaf's values; infinite: never reached
  bool turned = false;  ///< with directions
};

inline llmt::BoostedTree random_tree(const Kind& kind, int features, llmt::Random& random) {
  llmt::BoostedTree tree;
  std::vector<int*> open;  // where a leaf hangs
  const auto pick = [&](std::size_t count) { return static_cast<int>(random.below(count)); };
  tree.splits.reserve(kind.leaves);
  for (int k = 0; k + 1 < kind.leaves; ++k) {
    if (!open.empty()) {
      const int at = pick(open.size());
      *open[at] = k;
      open.erase(open.begin() + at);
    }
    tree.splits.push_back({.feature = pick(features),
                           .threshold = random.uniform(-1.0, 1.0),
                           .half_width = kind.soft && random.uniform() < 0.5 ? random.uniform(0.1, 1.5) : 0.0,
                           .missing_left = std::clamp(random.uniform(-1.0, 2.0), 0.0, 1.0)});
    open.push_back(&tree.splits.back().left);
    open.push_back(&tree.splits.back().right);
  }
  for (std::size_t k = 0; k < open.size(); ++k) *open[k] = -1 - static_cast<int>(k);
  if (random.uniform() < 0.5) tree.smallest_share = random.uniform() < 0.5 ? 0.0 : 0.2;
  for (int k = 0; k < kind.leaves; ++k) {
    llmt::BoostedLeaf leaf{.constant = random.normal(), .low = -kind.limit, .high = kind.limit};
    for (int feature = 0; feature < features; ++feature) {
      if (random.uniform() > 0.3 || std::ssize(leaf.features) == llmt::most_boosted_slopes) continue;
      leaf.features.push_back(feature);
      leaf.slopes.push_back(random.normal());
    }
    for (std::size_t j = 0; k % 2 == 0 && j < leaf.slopes.size(); ++j) leaf.means.push_back(random.uniform(-1.0, 1.0));
    tree.leaves.push_back(leaf);
  }
  return tree;
}

/// Four numbers and a category of three levels; pairs of numbers, and directions; two outputs.
inline llmt::BoostedModel model(const Kind& kind, std::uint64_t seed) {
  llmt::Random random(seed);
  std::vector<llmt::InputColumn> inputs;
  std::vector<double> deviations;
  std::vector<llmt::BoostedFeature> features;
  for (int j = 0; j < 4; ++j) {
    llmt::InputColumn input{.name = "x" + std::to_string(j), .low = -3.0, .high = 3.0};
    input.centre = random.uniform(-0.5, 0.5);
    inputs.push_back(input);
    deviations.push_back(random.uniform(0.5, 2.0));
    features.push_back({.inputs = {j}});
  }
  llmt::InputColumn colour{.name = "colour", .low = 0.0, .high = 2.0};
  colour.levels = {"blue", "green", seed % 2 == 0 ? "" : "red"};  // the last one may be that of missing values
  inputs.push_back(colour);
  deviations.push_back(1.0);
  for (int level = 0; level < 3; ++level) features.push_back({.inputs = {4}, .level = level});
  features.push_back({.inputs = {0, 1}, .factors = {1.0, 1.0}});
  features.push_back({.inputs = {1, 2}, .factors = {1.0, -1.0}});
  if (kind.turned) features.push_back({.inputs = {2, 0, 1}, .factors = {0.8, -0.5, 0.3}});
  if (kind.turned) features.push_back({.inputs = {3, 1}, .factors = {-0.6, 0.8}});
  std::vector<llmt::BoostedSum> sums;
  for (int output = 0; output < 2; ++output) {
    llmt::BoostedSum sum{.base = random.normal(), .rate = 0.3, .features = features, .trees = {}};
    for (int k = 0; k < kind.trees; ++k)
      sum.trees.push_back(random_tree(kind, static_cast<int>(std::ssize(features)), random));
    sums.push_back(std::move(sum));
  }
  return {inputs, {{.name = "p", .low = -9.0, .high = 9.0}, {.name = "q", .low = -9.0, .high = 9.0}}, deviations, sums};
}

/// Rows for the model; a cell in eight is missing, and some categories are unknown.
inline Eigen::MatrixXd rows(Eigen::Index count, std::uint64_t seed) {
  llmt::Random random(seed);
  Eigen::MatrixXd x(count, 5);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = 0; j < 4; ++j) x(i, j) = random.uniform(-2.0, 2.0);
    x(i, 4) = static_cast<double>(random.below(4));  // 3: unknown
    for (Eigen::Index j = 0; j < 5; ++j) {
      if (random.uniform() < 0.125) x(i, j) = no_value;
    }
  }
  return x;
}

}  // namespace random_boosted
