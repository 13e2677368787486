#include "growth/pruning.hpp"

#include "base/count.hpp"
#include "model/evaluator.hpp"

namespace llmt {

std::vector<std::size_t> prune(std::vector<Node>& nodes, const Eigen::VectorXd& weights, double m) {
  const double prior = weights.dot(nodes.front().rss) / static_cast<double>(nodes.front().samples);
  std::vector<double> error(nodes.size());  // E'
  // Children stand after their parents: backwards is from the leaves up.
  for (std::size_t i = nodes.size(); i-- > 0;) {
    Node& node = nodes[i];
    const double samples = static_cast<double>(node.samples);
    error[i] = (weights.dot(node.rss) + m * prior) / (samples + m);
    if (node.is_leaf()) continue;
    double backed = 0.0;
    for (const int child : {node.left, node.right}) {
      const std::size_t c = child;
      backed += (static_cast<double>(nodes[c].samples) + 0.5 * m) / (samples + m) * error[c];
    }
    if (error[i] <= backed) {
      make_leaf(node);
    } else {
      error[i] = backed;
    }
  }

  std::vector<Node> kept;
  std::vector<std::size_t> places;
  std::vector<int> new_index(nodes.size(), -1);
  std::vector<bool> reachable(nodes.size(), false);
  reachable[0] = true;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (!reachable[i]) continue;
    if (!nodes[i].is_leaf()) {
      reachable[nodes[i].left] = true;
      reachable[nodes[i].right] = true;
    }
    new_index[i] = count_of(kept);
    kept.push_back(nodes[i]);
    places.push_back(i);
  }
  for (Node& node : kept) {
    if (!node.is_leaf()) {
      node.left = new_index[node.left];
      node.right = new_index[node.right];
    }
  }
  nodes = std::move(kept);
  return places;
}

}  // namespace llmt
