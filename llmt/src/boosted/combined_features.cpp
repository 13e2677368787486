#include "boosted/combined_features.hpp"

#include <algorithm>
#include <utility>

#include "boosted/directions.hpp"

namespace llmt {
namespace {

// Contributions of inputs are found among all ways to take these inputs from two rows.
constexpr std::size_t most_turned = 8;

// How often each feature is used, counted once a level of a symmetric tree.
std::vector<int> uses_of(const std::vector<GrowingTree>& trees, std::size_t features) {
  std::vector<int> uses(features, 0);
  for (const GrowingTree& tree : trees) {
    std::vector<std::pair<int, int>> seen;
    for (const GrowingNode& node : tree) {
      const std::pair<int, int> split = {node.feature, node.cell};
      if (node.feature < 0 || std::ranges::count(seen, split) > 0) continue;
      seen.push_back(split);
      ++uses[node.feature];
    }
  }
  return uses;
}

// a + sign b, without inputs that cancel.
BoostedFeature sum_of(const BoostedFeature& a, const BoostedFeature& b, double sign) {
  BoostedFeature sum = a;
  for (std::size_t k = 0; k < b.inputs.size(); ++k) {
    const auto place = std::ranges::find(sum.inputs, b.inputs[k]);
    const auto factor = sum.factors.begin() + (place - sum.inputs.begin());
    if (place == sum.inputs.end()) {
      sum.inputs.push_back(b.inputs[k]);
      sum.factors.push_back(sign * b.factors[k]);
    } else if (*factor + sign * b.factors[k] != 0.0) {
      *factor += sign * b.factors[k];
    } else {
      sum.inputs.erase(place);
      sum.factors.erase(factor);
    }
  }
  return sum;
}

}  // namespace

std::vector<int> most_used(const BinnedRows& rows, const std::vector<GrowingTree>& trees, std::size_t most) {
  const std::vector<int> uses = uses_of(trees, rows.features.size());
  std::vector<int> features;
  for (int k = 0; k < std::ssize(uses); ++k) {
    if (rows.features[k].feature.level < 0) features.push_back(k);
  }
  std::ranges::stable_sort(features, std::greater{}, [&](int k) { return uses[k]; });
  if (features.size() > most) features.resize(most);
  std::ranges::sort(features);
  return features;
}

BinnedRows with_pairs(const BoostingData& data, BinnedRows rows, const std::vector<int>& features) {
  for (std::size_t i = 0; i < features.size(); ++i) {
    for (std::size_t j = i + 1; j < features.size(); ++j) {
      for (const double sign : {1.0, -1.0}) {
        const BoostedFeature& first = rows.features[features[i]].feature;
        rows.features.push_back(feature_of(data, sum_of(first, rows.features[features[j]].feature, sign)));
      }
    }
  }
  return rows;
}

BinnedRows with_directions(const BoostingData& data, const std::vector<GrowingTree>& symmetric,
                           const std::vector<GrowingTree>& trees, const BinnedRows& rows) {
  std::vector<int> inputs;
  for (const int feature : most_used(data.rows, symmetric, most_turned)) {
    inputs.push_back(data.rows.features[feature].feature.inputs.front());
  }
  BinnedRows turned = data.rows;
  if (inputs.size() < 2) return turned;
  for (const BoostedFeature& direction : directions_of(trees, rows, data, inputs)) {
    turned.features.push_back(feature_of(data, direction));
  }
  return turned;
}

}  // namespace llmt
