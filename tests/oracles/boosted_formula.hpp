// What a sum of trees predicts, by the equations (J.1) and (J.7) of docs/algorithms/boosting.md.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "llmt/boosted_model.hpp"

namespace boosted_formula {

/// The sum over the leaves below `at` of the shares of a row times the leaf's model, held to its range. `z`: the row's
/// features. `blends` counts the splits at which the row goes to both sides.
inline double tree_at(const llmt::BoostedTree& tree, const std::vector<double>& z, int at, double share, int& blends) {
  if (at < 0) {
    const llmt::BoostedLeaf& leaf = tree.leaves[-1 - at];
    double value = leaf.constant;
    for (std::size_t k = 0; k < leaf.features.size(); ++k) {
      const double stand_in = leaf.means.empty() ? 0.0 : leaf.means[k];
      value += leaf.slopes[k] * (std::isnan(z[leaf.features[k]]) ? stand_in : z[leaf.features[k]]);
    }
    return share * std::min(std::max(value, leaf.low), leaf.high);
  }
  const llmt::BoostedSplit& split = tree.splits[at];
  const double value = z[split.feature];
  if (std::isnan(value)) {
    double sum = 0.0;
    for (const bool is_left : {true, false}) {
      const double of_side = is_left ? split.missing_left : 1.0 - split.missing_left;
      if (of_side > 0.0) sum += tree_at(tree, z, is_left ? split.left : split.right, share * of_side, blends);
    }
    return sum;
  }
  const double u = (value - split.threshold) / split.half_width;
  const double right = 0.5 + u * (3.0 - u * u) / 4.0;
  if (std::abs(value - split.threshold) < split.half_width && share * right >= tree.smallest_share &&
      share * (1.0 - right) >= tree.smallest_share) {
    ++blends;
    const double left_value = tree_at(tree, z, split.left, share * (1.0 - right), blends);
    return left_value + tree_at(tree, z, split.right, share * right, blends);
  }
  return tree_at(tree, z, value <= split.threshold ? split.left : split.right, share, blends);
}

inline double tree_at(const llmt::BoostedTree& tree, const std::vector<double>& z, int& blends) {
  return tree_at(tree, z, tree.splits.empty() ? -1 : 0, 1.0, blends);
}

inline double sum_at(const llmt::BoostedModel& model, Eigen::Index output, const Eigen::VectorXd& x, int& blends) {
  const llmt::BoostedSum& sum = model.sums()[output];
  std::vector<double> z;
  for (const llmt::BoostedFeature& feature : sum.features) {
    const int first = feature.inputs[0];
    const std::vector<std::string>& names = model.inputs()[first].levels;
    const auto levels = static_cast<double>(names.size());
    const bool is_empty_level = std::isnan(x(first)) && !names.empty() && names.back().empty();
    const double level = is_empty_level ? levels - 1.0 : x(first);
    const double is_level = level < levels ? level == feature.level : std::numeric_limits<double>::quiet_NaN();
    double of_inputs = 0.0;
    for (std::size_t k = 0; k < feature.inputs.size(); ++k) {
      const int input = feature.inputs[k];
      of_inputs += feature.factors[k] * (x(input) - model.inputs()[input].centre) / model.deviations()[input];
    }
    z.push_back(feature.level >= 0 ? is_level : of_inputs);
  }
  double value = 0.0;
  for (const llmt::BoostedTree& tree : sum.trees) value += tree_at(tree, z, blends);
  return sum.base + sum.rate * value;
}

}  // namespace boosted_formula
