#include "model/shared_leaves.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <stdexcept>

#include "model/tree.hpp"

namespace llmt {
namespace {

// Whether the nodes form one tree with children behind their parents. Model names what is wrong if not.
bool is_tree(const std::vector<Node>& nodes) {
  std::vector<bool> has_parent(nodes.size(), false);
  for (int i = 0; i < std::ssize(nodes); ++i) {
    if (nodes[i].is_leaf()) continue;
    for (const int child : {nodes[i].left, nodes[i].right}) {
      if (child <= i || child >= std::ssize(nodes) || has_parent[child]) return false;
      has_parent[child] = true;
    }
  }
  for (std::size_t i = 1; i < nodes.size(); ++i) {
    if (!has_parent[i]) return false;
  }
  return !nodes.empty();
}

// For each first leaf of a shared local model, the lowest node above all its leaves; -1 where only one leaf has it.
//
// In depth-first order the lowest node above several leaves is the lowest above the first and the last of them: the
// last node on the path to the last leaf that was visited before the first leaf.
std::vector<int> common_ancestors(const Partition& partition, const std::vector<std::optional<int>>& shared_with) {
  const std::vector<Node>& nodes = partition.nodes;
  const std::vector<int> parents = parents_of(partition);
  std::vector<int> visited(nodes.size(), -1);  // position in depth-first order
  std::vector<int> first_visited(nodes.size(), -1);
  std::vector<int> result(nodes.size(), -1);
  std::vector<int> path;
  std::vector<int> to_visit = {0};
  for (int position = 0; !to_visit.empty(); ++position) {
    const int i = to_visit.back();
    to_visit.pop_back();
    while (!path.empty() && path.back() != parents[i]) path.pop_back();
    path.push_back(i);
    visited[i] = position;
    if (!nodes[i].is_leaf()) {
      to_visit.insert(to_visit.end(), {nodes[i].right, nodes[i].left});
      continue;
    }
    const int first = shared_with[i] ? *shared_with[i] : i;
    if (first_visited[first] < 0) {
      first_visited[first] = position;
    } else {
      const auto below = std::ranges::upper_bound(path, first_visited[first], {}, [&](int n) { return visited[n]; });
      result[first] = *std::prev(below);
    }
  }
  return result;
}

}  // namespace

void set_guard_parents(Partition& partition, const std::vector<std::optional<int>>& shared_with) {
  std::vector<Node>& nodes = partition.nodes;
  if (!is_tree(nodes)) return;
  for (int i = 0; i < std::ssize(nodes); ++i) {
    if (!shared_with[i]) continue;
    const int first = *shared_with[i];
    if (first < 0 || first >= i || !nodes[i].is_leaf() || !nodes[first].is_leaf() || shared_with[first]) {
      throw std::invalid_argument(fmt::format(
          "node {}: shared_with is {}, it must be an earlier leaf that does not share another's local model", i,
          first));
    }
  }
  const std::vector<int> common = common_ancestors(partition, shared_with);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const int first = shared_with[i] ? *shared_with[i] : static_cast<int>(i);
    if (common[first] >= 0) nodes[i].guard_parent = common[first];
  }
}

}  // namespace llmt
