#include "explain/game_rule.hpp"

#include <algorithm>

#include "numerics/quadrature.hpp"

namespace llmt {

int order_for(const BoostedTree& tree, const std::vector<BoostedFeature>& features) {
  std::vector<int> uses;  // of each input, on the path
  int inputs = 0;
  const auto use = [&](int input, int change) {
    if (std::ssize(uses) <= input) uses.resize(input + 1, 0);
    inputs += change > 0 ? uses[input] == 0 : -static_cast<int>(uses[input] == 1);
    uses[input] += change;
  };
  const auto use_feature = [&](int feature, int change) {
    for (const int input : features[feature].inputs) use(input, change);
  };
  int most_inputs = 0;
  struct Visit {
    int at;
    bool is_over;
  };
  std::vector<Visit> visits = {{tree.splits.empty() ? -1 : 0, false}};
  while (!visits.empty()) {
    const auto [at, is_over] = visits.back();
    visits.pop_back();
    if (at < 0) {
      const std::vector<int>& of_leaf = tree.leaves[-1 - at].features;
      for (const int feature : of_leaf) use_feature(feature, 1);
      most_inputs = std::max(most_inputs, inputs);
      for (const int feature : of_leaf) use_feature(feature, -1);
      continue;
    }
    const BoostedSplit& split = tree.splits[at];
    use_feature(split.feature, is_over ? -1 : 1);
    if (is_over) continue;
    visits.push_back({at, true});
    visits.push_back({split.left, false});
    visits.push_back({split.right, false});
  }
  return std::max(2, (most_inputs + 3) / 4 * 2);
}

GameRule::GameRule(int order) {
  const Quadrature rule = gauss_legendre(order);
  row = rule.nodes;
  weights = rule.weights;
  for (int k = 0; k < order; ++k) {
    background.push_back(1.0 - row[k]);
    per_row.push_back(weights[k] / row[k]);
    per_background.push_back(-weights[k] / background[k]);
  }
}

}  // namespace llmt
