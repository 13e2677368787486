// Trees that are chains, as deep as they have leaves.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "llmt/model.hpp"

namespace oracle {

/// Whether the chain goes on in the left or in the right children.
enum class Way { left, right };

/// A chain of `leaves` leaves on two inputs in [-1, 1]. Every split is on the first input, at 0. `half_width` above 0:
/// all leaves reach every row. Only the root has a range, so that every leaf's guard asks all its ancestors.
inline llmt::Model chain(int leaves, llmt::ValidityKind kind, double half_width, Way way = Way::left) {
  const Eigen::Vector2d nothing = Eigen::Vector2d::Zero();
  llmt::Partition partition;
  partition.outputs = {0};
  partition.validity = {.kind = kind, .width = half_width};
  partition.nodes.resize(2 * leaves - 1);
  for (int i = 0; i < 2 * leaves - 1; ++i) {
    llmt::Node& node = partition.nodes[i];
    node.samples = 100;
    node.rank = 1;
    node.rss = Eigen::VectorXd::Constant(1, 1.0);
    node.value = Eigen::VectorXd::Constant(1, i % 7);
    node.slope = Eigen::RowVector2d(1.0 / (1.0 + i), i % 3);
    node.mean = node.low = node.high = nothing;
  }
  partition.nodes[0].low.setConstant(-1.0);
  partition.nodes[0].high.setConstant(1.0);
  for (int k = 1; k < leaves; ++k) {
    const int parent = k == 1 ? 0 : 2 * k - 2 - (way == Way::left ? 1 : 0);
    llmt::Node& node = partition.nodes[parent];
    node.left = 2 * k - 1;
    node.right = 2 * k;
    node.split_input = 0;
    node.half_width = half_width;
  }
  return {{{.name = "a", .low = -1.0, .high = 1.0}, {.name = "b", .low = -1.0, .high = 1.0}},
          {{.name = "y", .low = 0.0, .high = 10.0}},
          {{.input = 0}, {.input = 1}},
          {std::move(partition)}};
}

}  // namespace oracle
