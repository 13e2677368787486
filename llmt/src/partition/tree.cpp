#include "partition/tree.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <stdexcept>

namespace llmt {

void make_leaf(Node& node) {
  node.left = node.right = node.split_input = -1;
  node.threshold = 0.0;
  node.direction.resize(0);
  node.half_width = 0.0;
  node.level_side.clear();
}

Partition prefix(const Partition& partition, Eigen::Index max_leaves) {
  if (max_leaves < 1) {
    throw std::invalid_argument(fmt::format("llmt::prefix: max_leaves is {}, it must be at least 1", max_leaves));
  }
  const Eigen::Index kept = 2 * std::min(max_leaves, partition.num_leaves()) - 1;
  Partition result{.outputs = partition.outputs,
                   .validity = partition.validity,
                   .nodes = {partition.nodes.begin(), partition.nodes.begin() + kept},
                   .outer_slope = partition.outer_slope,
                   .residual_range = partition.residual_range,
                   .output_range = partition.output_range};
  for (Node& node : result.nodes) {
    if (node.left >= kept) {
      make_leaf(node);
    }
  }
  return result;
}

Eigen::MatrixXd agreed_slope(const Partition& grown, Eigen::Index leaves) {
  const Eigen::Index kept = 2 * std::min({leaves, leaves_that_agree, grown.num_leaves()}) - 1;
  const Node& root = grown.nodes.front();
  Eigen::MatrixXd spread = Eigen::MatrixXd::Zero(root.slope.rows(), root.slope.cols());
  for (Eigen::Index i = 0; i < kept; ++i) {
    const Node& node = grown.nodes[i];
    if (node.is_leaf() || node.left >= kept) {
      spread +=
          static_cast<double>(node.samples) / static_cast<double>(root.samples) * (node.slope - root.slope).cwiseAbs2();
    }
  }
  Eigen::MatrixXd slope = root.slope;
  for (Eigen::Index o = 0; o < spread.rows(); ++o) {
    for (Eigen::Index k = 0; k < spread.cols(); ++k) {
      const double squared = root.slope(o, k) * root.slope(o, k);
      slope(o, k) *= squared > spread(o, k) ? 1.0 - spread(o, k) / squared : 0.0;
    }
  }
  return slope;
}

Partition grown_prefix(const Partition& grown, Eigen::Index leaves) {
  Partition result = prefix(grown, leaves);
  result.outer_slope = result.num_leaves() > 1 ? agreed_slope(grown, leaves) : Eigen::MatrixXd();
  return result;
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
