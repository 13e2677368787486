#include "constraints/monotone_splits.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "partition/transition.hpp"
#include "partition/tree.hpp"

namespace llmt {
namespace {

// The training rows' most frequent level of each categorical input; -1 for numbers.
std::vector<int> usual_levels(const TrainingRows& training) {
  using Counts = std::vector<std::vector<Eigen::Index>>;  // of each level of each input
  Counts zero;
  for (const int levels : training.table->num_levels) zero.emplace_back(levels, 0);
  const auto add = [&](RowSpan block, Counts& counts) {
    for (std::size_t input = 0; input < counts.size(); ++input) {
      if (counts[input].empty()) continue;
      for (Eigen::Index i = block.begin; i < block.end; ++i) {
        ++counts[input][static_cast<std::size_t>(training.table->inputs(training.rows[i], input))];
      }
    }
  };
  std::vector<int> result;
  for (const std::vector<Eigen::Index>& counts : sum_over(RowBlocks{training.count()}, 1, std::move(zero), add)) {
    result.push_back(counts.empty() ? -1 : static_cast<int>(std::ranges::max_element(counts) - counts.begin()));
  }
  return result;
}

Eigen::Index numeric_regressor(const TrainingRows& training, int input) {
  for (Eigen::Index k = 0; k < std::ssize(training.regressors); ++k) {
    if (training.regressors[k].input == input && training.regressors[k].level < 0) {
      return k;
    }
  }
  return -1;
}

}  // namespace

double half_width_of(const Node& node) { return std::isfinite(1.0 / node.half_width) ? node.half_width : 0.0; }

int ordered_sign(const Node& node, const TrainingRows& training) {
  const std::vector<int>& monotone = training.table->monotone;
  return node.is_leaf() || monotone.empty() || !node.level_side.empty() ? 0 : monotone[node.split_input];
}

bool has_ordered_splits(const Partition& partition, const TrainingRows& training) {
  return std::ranges::any_of(partition.nodes, [&](const Node& node) { return ordered_sign(node, training) != 0; });
}

Supports supports_of(const Partition& partition, Eigen::Index inputs) {
  const Eigen::Index nodes = std::ssize(partition.nodes);
  const double infinity = std::numeric_limits<double>::infinity();
  Supports result{Eigen::MatrixXd::Constant(inputs, nodes, -infinity),
                  Eigen::MatrixXd::Constant(inputs, nodes, infinity)};
  for (Eigen::Index i = 0; i < nodes; ++i) {
    const Node& node = partition.nodes[i];
    if (node.is_leaf()) continue;
    for (const int child : {node.left, node.right}) {
      result.low.col(child) = result.low.col(i);
      result.high.col(child) = result.high.col(i);
    }
    if (node.level_side.empty()) {
      double& high = result.high(node.split_input, node.left);
      double& low = result.low(node.split_input, node.right);
      high = std::min(high, node.threshold + half_width_of(node));
      low = std::max(low, node.threshold - half_width_of(node));
    }
  }
  return result;
}

void limit_half_widths(Partition& partition, const TrainingRows& training) {
  for (Node& node : partition.nodes) {
    if (ordered_sign(node, training) == 0) continue;
    if (const Eigen::Index k = numeric_regressor(training, node.split_input); k >= 0) {
      const double centre = training.regressors[k].centre;
      const double margin =
          std::min(node.threshold - centre - training.spread(0, k), centre + training.spread(1, k) - node.threshold);
      node.half_width = std::clamp(node.half_width, 0.0, std::max(margin, 0.0));
    }
  }
}

namespace {

// Widens a node's ranges of the monotone inputs to where it may have validity, within the range of all rows.
void widen_ranges(Partition& partition, const TrainingRows& training, const Supports& supports, Eigen::Index index) {
  Node& node = partition.nodes[index];
  const Node& root = partition.nodes.front();
  for (int input = 0; input < std::ssize(training.columns); ++input) {
    const Eigen::Index k = numeric_regressor(training, input);
    if (training.table->monotone[input] == 0 || k < 0) continue;
    const double centre = training.regressors[k].centre;
    const double least = index == 0 ? training.spread(0, k) : root.low(k);
    const double most = index == 0 ? training.spread(1, k) : root.high(k);
    const double low = std::max(supports.low(input, index) - centre, least);
    const double high = std::min(supports.high(input, index) - centre, most);
    if (low <= high) {
      node.low(k) = std::min(node.low(k), low);
      node.high(k) = std::max(node.high(k), high);
    }
  }
}

// The validity of the left child where the input has its mean, or its most frequent level `usual_level`.
double left_at_usual_value(const Node& node, const TrainingRows& training, int usual_level) {
  if (!node.level_side.empty()) {
    const int side = node.level_side[usual_level];
    return side < 0 || (side == 0 && node.missing_left >= 0.5) ? 1.0 : 0.0;
  }
  const double centre = training.columns[node.split_input].centre;
  const double h = half_width_of(node);
  if (h > 0.0) return transition((centre - node.threshold) / h);
  return centre <= node.threshold ? 1.0 : 0.0;
}

}  // namespace

void prepare_ordered_splits(Partition& partition, const TrainingRows& training) {
  const Supports supports = supports_of(partition, std::ssize(training.columns));
  const std::vector<int> usual = usual_levels(training);
  for (Eigen::Index i = 0; i < std::ssize(partition.nodes); ++i) {
    widen_ranges(partition, training, supports, i);
    Node& node = partition.nodes[i];
    node.mean.setZero();
    if (node.is_leaf()) continue;
    node.missing_left = left_at_usual_value(node, training, usual[node.split_input]);
  }
}

}  // namespace llmt
