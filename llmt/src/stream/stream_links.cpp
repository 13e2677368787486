#include "stream/stream_links.hpp"

#include <fmt/format.h>

#include <utility>

#include "llmt/limits.hpp"

namespace llmt {

std::vector<const StreamNode*> nodes_of(const StreamNode& root) {
  std::vector<const StreamNode*> nodes = {&root};
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    const StreamNode& node = *nodes[k];
    for (const StreamNode* below : {node.children[0].get(), node.children[1].get(), node.alternate.get()}) {
      if (below != nullptr) nodes.push_back(below);
    }
  }
  return nodes;
}

std::vector<StreamLinks> links_of(const std::vector<const StreamNode*>& nodes) {
  std::vector<StreamLinks> links;
  int next = 1;
  for (const StreamNode* node : nodes) {
    StreamLinks& of = links.emplace_back();
    if (!node->is_leaf()) {
      of.left = next++;
      of.right = next++;
    }
    if (node->alternate) of.alternate = next++;
  }
  return links;
}

std::unique_ptr<StreamNode> joined(std::vector<std::unique_ptr<StreamNode>> nodes,
                                   const std::vector<StreamLinks>& links, const JsonReader& json) {
  const auto take = [&](std::size_t from, int at) {
    if (static_cast<std::size_t>(at) <= from || at >= std::ssize(nodes) || nodes[at] == nullptr) {
      json.fail(fmt::format("node {} leads to {}, which is not a later node, or has been led to before", from, at));
    }
    return std::move(nodes[at]);
  };
  // Nodes hold their children, so that a chain of them ends as deep in the stack as it is long.
  std::vector<std::int64_t> splits_above(nodes.size(), 0);
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    for (const int below : {links[k].left, links[k].right, links[k].alternate}) {
      if (below <= static_cast<int>(k) || below >= std::ssize(nodes)) continue;
      splits_above[below] = splits_above[k] + 1;
      if (splits_above[below] > most(Limit::model_splits_above_leaf)) {
        json.fail(fmt::format("the tree is deeper than {} splits", most(Limit::model_splits_above_leaf)));
      }
    }
  }
  for (std::size_t k = nodes.size(); k-- > 0;) {
    if (nodes[k] == nullptr) continue;
    StreamNode& node = *nodes[k];
    if (links[k].left >= 0) node.children = {take(k, links[k].left), take(k, links[k].right)};
    if (links[k].alternate >= 0) node.alternate = take(k, links[k].alternate);
  }
  for (std::size_t k = 1; k < nodes.size(); ++k) {
    if (nodes[k] != nullptr) json.fail(fmt::format("no node leads to node {}", k));
  }
  return std::move(nodes.front());
}

}  // namespace llmt
