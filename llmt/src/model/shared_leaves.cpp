#include "model/shared_leaves.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "model/tree.hpp"

namespace llmt {
namespace {

// Whether children stand behind their parents, so that parents_of() may be asked. Model names what is wrong if not.
bool is_tree(const std::vector<Node>& nodes) {
  std::vector<bool> has_parent(nodes.size(), false);
  for (int i = 0; i < std::ssize(nodes); ++i) {
    if (nodes[i].is_leaf()) continue;
    for (const int child : {nodes[i].left, nodes[i].right}) {
      if (child <= i || child >= std::ssize(nodes)) return false;
      has_parent[child] = true;
    }
  }
  for (std::size_t i = 1; i < nodes.size(); ++i) {
    if (!has_parent[i]) return false;
  }
  return true;
}

}  // namespace

void set_guard_parents(Partition& partition, const std::vector<std::optional<int>>& shared_with) {
  std::vector<Node>& nodes = partition.nodes;
  if (!is_tree(nodes)) return;
  const std::vector<int> parents = parents_of(partition);
  for (int i = 0; i < std::ssize(nodes); ++i) {
    if (!shared_with[i]) continue;
    const int first = *shared_with[i];
    if (first < 0 || first >= i || !nodes[i].is_leaf() || !nodes[first].is_leaf() || shared_with[first]) {
      throw std::invalid_argument(fmt::format(
          "node {}: shared_with is {}, it must be an earlier leaf that does not share another's local model", i,
          first));
    }
    int a = i;
    int b = nodes[first].guard_parent >= 0 ? nodes[first].guard_parent : parents[first];
    while (a != b) {  // parents stand before their children
      int& lower = a > b ? a : b;
      lower = parents[lower];
    }
    nodes[first].guard_parent = a;
  }
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (shared_with[i]) nodes[i].guard_parent = nodes[*shared_with[i]].guard_parent;
  }
}

}  // namespace llmt
