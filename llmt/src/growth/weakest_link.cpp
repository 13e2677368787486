#include <queue>

#include "base/count.hpp"
#include "growth/gain_order.hpp"
#include "growth/pruning.hpp"

namespace llmt {
namespace {

// Splits that are made one after the other, the topmost first.
struct Block {
  double gain = 0.0;
  double splits = 1.0;
  int last = -1;  // node of the last of them
};

std::vector<double> gains_of(const std::vector<Node>& nodes) {
  const Eigen::VectorXd whole = nodes.front().rss.unaryExpr([](double rss) { return rss > 0.0 ? 1.0 / rss : 0.0; });
  std::vector<double> gains(nodes.size(), 0.0);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (!nodes[i].is_leaf()) {
      const Eigen::VectorXd below = nodes[nodes[i].left].rss + nodes[nodes[i].right].rss;
      gains[i] = whole.dot(nodes[i].rss - below);
    }
  }
  return gains;
}

// The order of the splits, by their nodes, that makes the sum of the gains of the first 1, 2, 3, ... splits largest,
// every split behind the one above it. Horn (1972), for jobs of equal length under an outtree: the block with the
// largest mean gain follows at once on the block above it.
std::vector<int> order_of_splits(const std::vector<Node>& nodes, const std::vector<double>& gains) {
  std::vector<int> top(nodes.size(), -1);  // of the block that a split is in, or one nearer to that
  std::vector<int> above(nodes.size(), -1);
  std::vector<int> next(nodes.size(), -1);
  std::vector<Block> blocks(nodes.size());
  // Blocks that wait to be joined to the block of the split above, by their mean gain: topmost node, and the number of
  // splits when they were entered.
  std::priority_queue<ByGain<double>> queue;
  for (int node = 0; node < std::ssize(nodes); ++node) {
    if (nodes[node].is_leaf()) continue;
    above[nodes[node].left] = above[nodes[node].right] = node;
    top[node] = node;
    blocks[node] = {gains[node], 1.0, node};
    if (node > 0) {
      queue.push({static_cast<float>(gains[node]), node, 1.0});
    }
  }
  const auto top_of = [&](int node) {
    while (top[node] != node) {
      int& at = top[node];
      at = top[at];
      node = at;
    }
    return node;
  };
  while (!queue.empty()) {
    const ByGain<double> first = queue.top();
    queue.pop();
    const std::size_t own = first.node;
    if (top[own] != first.node || blocks[own].splits != first.content) {
      continue;  // it has been joined, or has grown since
    }
    const int onto = top_of(above[own]);
    Block& block = blocks[onto];
    next[block.last] = first.node;
    block.last = blocks[own].last;
    block.gain += blocks[own].gain;
    block.splits += blocks[own].splits;
    top[own] = onto;
    if (onto != 0) {
      queue.push({static_cast<float>(block.gain / block.splits), onto, block.splits});
    }
  }
  std::vector<int> order;
  for (int node = nodes.front().is_leaf() ? -1 : 0; node >= 0; node = next[node]) {
    order.push_back(node);
  }
  return order;
}

}  // namespace

std::vector<Node> in_pruning_order(const std::vector<Node>& nodes, std::vector<double> gains) {
  if (gains.empty()) {
    gains = gains_of(nodes);
  }
  std::vector<Node> result = {nodes.front()};
  std::vector<int> place(nodes.size(), 0);  // in the result
  for (const int split : order_of_splits(nodes, gains)) {
    const Node& node = nodes[split];
    Node& placed = result[place[split]];
    placed.left = count_of(result);
    placed.right = placed.left + 1;
    for (const int child : {node.left, node.right}) {
      place[child] = count_of(result);
      result.push_back(nodes[child]);
    }
  }
  return result;
}

}  // namespace llmt
