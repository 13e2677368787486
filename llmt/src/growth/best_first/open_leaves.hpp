/// \file
/// Leaves of a growing tree that may still be split, whichever way their splits are searched.
#pragma once

#include <array>
#include <optional>
#include <variant>

#include "growth/best_first/binned_leaves.hpp"
#include "growth/best_first/exact_leaves.hpp"
#include "growth/best_first/residual_leaves.hpp"
#include "growth/growth_data.hpp"

namespace llmt {

/// A leaf with its local model fitted and its best split found.
struct OpenLeaf {
  int node = 0;
  std::variant<ExactLeaf, BinnedLeaf, ResidualLeaf> data;
  double weight = 0.0;  ///< of its rows
  double rss = 0.0;     ///< of its local model, weighted over the outputs
  SplitCandidate best;  ///< input: position among the split inputs
  double excess = 0.0;  ///< what a split inside a bin could gain on `best`, at most
};

/// Opens, searches and divides leaves, each by its own kind of search.
///
/// RD and RETIS search the leaves by bins if the options and the number of rows say so, RA by the residuals of
/// whitened features if no value is missing. Leaves below 2000 rows are searched exactly.
class OpenLeaves {
 public:
  /// `data` must live as long as this.
  explicit OpenLeaves(const GrowthData& data);

  /// The leaf of all rows, not yet examined. `parentless`: a node whose local model is zero.
  OpenLeaf root(const Node& parentless) const;

  /// Fits the leaf's local model, which fills in `node`, and finds its best split. May run for two leaves at once.
  void examine(OpenLeaf& leaf, const Node& parent, Node& node);

  /// Frees memory of a leaf that waits for its turn, if there is too little for all.
  void wait(OpenLeaf& leaf);

  struct Children {
    std::array<OpenLeaf, 2> leaves;  ///< not yet examined
    double missing_left = 0.0;       ///< see Node::missing_left
  };

  /// Divides the rows of a leaf, whose local model is in `node`, by its best split.
  Children divide(OpenLeaf& leaf, const Node& node);

  /// Node::threshold of the leaf's best split, given the local models of the node and its two children.
  double threshold(const OpenLeaf& leaf, const Node& node, const Node& left, const Node& right) const;

 private:
  template <class Leaf>
  Children open_parts(const Leaf& leaf, std::array<Leaf, 2> parts, const Node& parent) const;

  const GrowthData& data_;
  ExactLeaves exact_;
  std::optional<BinnedLeaves> binned_;
  std::optional<ResidualLeaves> residual_;
};

}  // namespace llmt
