#include "model/tree.hpp"

#include <algorithm>
#include <limits>

namespace llmt {

void make_leaf(Node& node) {
  node.left = node.right = node.split_input = -1;
  node.threshold = 0.0;
  node.direction.resize(0);
  node.half_width = 0.0;
  node.level_side.clear();
}

std::vector<int> parents_of(const Partition& partition) {
  std::vector<int> parents(partition.nodes.size(), -1);
  for (int i = 0; i < std::ssize(partition.nodes); ++i) {
    const Node& node = partition.nodes[i];
    if (!node.is_leaf()) {
      parents[node.left] = i;
      parents[node.right] = i;
    }
  }
  return parents;
}

std::vector<int> guard_parents_of(const Partition& partition) {
  std::vector<int> result = parents_of(partition);
  for (std::size_t i = 0; i < partition.nodes.size(); ++i) {
    if (const int given = partition.nodes[i].guard_parent; given >= 0) result[i] = given;
  }
  return result;
}

Boxes boxes_of(const Partition& partition, const Eigen::VectorXd& low, const Eigen::VectorXd& high) {
  const Eigen::Index nodes = std::ssize(partition.nodes);
  Boxes boxes{low.replicate(1, nodes), high.replicate(1, nodes)};
  for (Eigen::Index i = 0; i < nodes; ++i) {
    const Node& node = partition.nodes[i];
    if (node.is_leaf()) continue;
    for (const int child : {node.left, node.right}) {
      boxes.low.col(child) = boxes.low.col(i);
      boxes.high.col(child) = boxes.high.col(i);
    }
    if (node.level_side.empty() && !node.is_oblique() && node.threshold < std::numeric_limits<double>::max()) {
      boxes.high(node.split_input, node.left) = std::min(boxes.high(node.split_input, i), node.threshold);
      boxes.low(node.split_input, node.right) = std::max(boxes.low(node.split_input, i), node.threshold);
    }
  }
  return boxes;
}

void set_half_widths(Partition& partition, const Eigen::VectorXd& low, const Eigen::VectorXd& high) {
  if (partition.validity.kind == ValidityKind::logistic) {
    for (Node& node : partition.nodes) {
      node.half_width *= partition.validity.width;
    }
    return;
  }
  const Boxes boxes = boxes_of(partition, low, high);
  const double width = partition.validity.kind == ValidityKind::blend ? partition.validity.width : 0.0;
  for (std::size_t i = 0; i < partition.nodes.size(); ++i) {
    Node& node = partition.nodes[i];
    node.half_width = 0.0;
    if (!node.is_leaf() && node.level_side.empty() && !node.is_oblique() &&
        node.threshold < std::numeric_limits<double>::max()) {
      const Eigen::Index box = i;
      const double extent = std::min(node.threshold - boxes.low(node.split_input, box),
                                     boxes.high(node.split_input, box) - node.threshold);
      node.half_width = std::max(0.0, width * extent);
    }
  }
}

}  // namespace llmt
