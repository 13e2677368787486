#include "readable/cost_complexity.hpp"

namespace llmt {

std::vector<int> cheapest_tree(const std::vector<PricedNode>& nodes, double price) {
  std::vector<int> pruned(nodes.size(), 0);
  std::vector<double> cost(nodes.size(), 0.0);
  const auto of_size = [price](Eigen::Index size) { return price * static_cast<double>(size); };
  for (std::size_t i = nodes.size(); i-- > 0;) {
    const PricedNode& node = nodes[i];
    for (std::size_t k = 0; k < node.errors.size(); ++k) {
      const double of_equation = node.errors[k] + of_size(node.sizes[k]);
      if (k == 0 || of_equation < cost[i]) {
        cost[i] = of_equation;
        pruned[i] = static_cast<int>(k);
      }
    }
    if (node.left < 0) continue;
    const double of_split = cost[node.left] + cost[node.right] + of_size(node.split_size);
    if (of_split < cost[i]) {
      cost[i] = of_split;
      pruned[i] = stays_split;
    }
  }
  return pruned;
}

std::vector<int> nodes_of(const std::vector<PricedNode>& nodes, const std::vector<int>& pruned) {
  std::vector<bool> there(nodes.size(), false);
  there[0] = true;
  std::vector<int> result;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (!there[i]) continue;
    result.push_back(static_cast<int>(i));
    if (pruned[i] != stays_split) continue;
    there[nodes[i].left] = true;
    there[nodes[i].right] = true;
  }
  return result;
}

}  // namespace llmt
