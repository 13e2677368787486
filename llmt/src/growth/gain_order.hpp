/// \file
/// Which of several splits comes next.
#pragma once

#include <vector>

#include "llmt/model.hpp"

namespace llmt {

/// A split that waits for its turn in a std::priority_queue: the largest gain comes first, then the oldest node.
///
/// The gain is held in single precision, so that gains that differ by rounding alone count as equal and the older node
/// decides.
template <class Content>
struct ByGain {
  float gain = 0.0F;
  int node = 0;
  Content content = {};

  friend bool operator<(const ByGain& a, const ByGain& b) {
    return a.gain != b.gain ? a.gain < b.gain : a.node > b.node;
  }
};

/// The gains of the splits that `nodes` still has: one entry per node, 0 for leaves. `gains` may hold further entries,
/// of nodes that were removed from the end.
inline std::vector<double> gains_of_splits(const std::vector<Node>& nodes, std::vector<double> gains) {
  gains.resize(nodes.size(), 0.0);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (nodes[i].is_leaf()) gains[i] = 0.0;
  }
  return gains;
}

}  // namespace llmt
