/// \file
/// The nodes of a tree as a list, as the state of a stream has them.
#pragma once

#include <memory>
#include <vector>

#include "model_files/model_json.hpp"
#include "stream/node.hpp"

namespace llmt {

/// The nodes that a node leads to, as positions in the list of nodes; -1: none.
struct StreamLinks {
  int left = -1;
  int right = -1;
  int alternate = -1;
};

/// A tree's nodes, every node before those that it leads to.
std::vector<const StreamNode*> nodes_of(const StreamNode& root);

/// The links of nodes in the order of nodes_of().
std::vector<StreamLinks> links_of(const std::vector<const StreamNode*>& nodes);

/// Puts the nodes into each other; the first one is the root. Fails as `json` for links that are those of no tree, and
/// for a tree deeper than Limit::model_splits_above_leaf.
std::unique_ptr<StreamNode> joined(std::vector<std::unique_ptr<StreamNode>> nodes,
                                   const std::vector<StreamLinks>& links, const JsonReader& json);

}  // namespace llmt
