#include "constraints/ordered_splits_geometry.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/hold.hpp"
#include "model/transition.hpp"
#include "model/tree.hpp"

namespace llmt {
namespace {

// The training rows' most frequent level of each categorical input; -1 for numbers.
std::vector<int> usual_levels(const TrainingRows& training) {
  std::vector<int> result;
  for (std::size_t input = 0; input < training.columns.size(); ++input) {
    const int levels = training.table->num_levels[input];
    std::vector<Eigen::Index> count(levels, 0);
    for (std::size_t row = 0; levels > 0 && row < training.rows.size(); ++row) {
      const double value = training.table->inputs(training.rows[row], input);
      ++count[static_cast<std::size_t>(value)];
    }
    result.push_back(levels > 0 ? static_cast<int>(std::ranges::max_element(count) - count.begin()) : -1);
  }
  return result;
}

Eigen::Index numeric_regressor(const TrainingRows& training, int input) {
  for (std::size_t k = 0; k < training.regressors.size(); ++k) {
    if (training.regressors[k].input == input && training.regressors[k].level < 0) {
      return static_cast<Eigen::Index>(k);
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
      const double room =
          std::min(node.threshold - centre - training.spread(0, k), centre + training.spread(1, k) - node.threshold);
      node.half_width = std::clamp(node.half_width, 0.0, std::max(room, 0.0));
    }
  }
}

void prepare_ordered_splits(Partition& partition, const TrainingRows& training) {
  const Supports supports = supports_of(partition, std::ssize(training.columns));
  const std::vector<int> usual = usual_levels(training);
  for (std::size_t i = 0; i < partition.nodes.size(); ++i) {
    Node& node = partition.nodes[i];
    for (std::size_t j = 0; j < training.columns.size(); ++j) {
      const Eigen::Index k = numeric_regressor(training, static_cast<int>(j));
      if (training.table->monotone[j] == 0 || k < 0) continue;
      const Eigen::Index input = static_cast<Eigen::Index>(j);
      const double centre = training.regressors[k].centre;
      const Node& root = partition.nodes.front();
      const double least = i == 0 ? training.spread(0, k) : root.low(k);
      const double most = i == 0 ? training.spread(1, k) : root.high(k);
      const double low = std::max(supports.low(input, i) - centre, least);
      const double high = std::min(supports.high(input, i) - centre, most);
      if (low <= high) {
        node.low(k) = std::min(node.low(k), low);
        node.high(k) = std::max(node.high(k), high);
      }
    }
    node.mean.setZero();
    if (node.is_leaf()) continue;
    const std::size_t input = node.split_input;
    if (!node.level_side.empty()) {
      const int side = node.level_side[usual[input]];
      node.missing_left = side < 0 || (side == 0 && node.missing_left >= 0.5) ? 1.0 : 0.0;
    } else {
      const double centre = training.columns[input].centre;
      const double h = half_width_of(node);
      node.missing_left = h > 0.0 ? transition((centre - node.threshold) / h, partition.validity.smoothness)
                          : centre <= node.threshold ? 1.0
                                                     : 0.0;
    }
  }
}

OrderedSplits::Geometry::Geometry(const Partition& partition, const TrainingRows& training, Eigen::Index output)
    : partition_(partition),
      training_(training),
      output_(output),
      parents_(parents_of(partition)),
      regressors_(training.columns.size()) {
  Supports supports = supports_of(partition, inputs());
  low_ = std::move(supports.low);
  high_ = std::move(supports.high);
  missing_ = Eigen::MatrixXi::Ones(inputs(), std::ssize(partition.nodes));
  for (std::size_t k = 0; k < training.regressors.size(); ++k) {
    regressors_[training.regressors[k].input].push_back(k);
  }
  for (int input = 0; input < inputs(); ++input) {
    levels_.emplace_back(is_categorical(input) ? partition.nodes.size() : 0, std::vector<char>(levels(input), 1));
  }
  for (std::size_t i = 0; i < partition.nodes.size(); ++i) {
    signs_.push_back(ordered_sign(partition.nodes[i], training));
    hand_down(static_cast<int>(i));
  }
}

// Which levels, and whether missing values, reach the children.
void OrderedSplits::Geometry::hand_down(int index) {
  const Node& parent = node(index);
  if (parent.is_leaf()) return;
  for (const int child : {parent.left, parent.right}) {
    missing_.col(child) = missing_.col(index);
    for (std::vector<std::vector<char>>& of_input : levels_) {
      if (!of_input.empty()) {
        of_input[child] = of_input[index];
      }
    }
  }
  const bool to_left = parent.missing_left > 0.0;
  const bool to_right = parent.missing_left < 1.0;
  missing_(parent.split_input, parent.left) &= static_cast<int>(to_left);
  missing_(parent.split_input, parent.right) &= static_cast<int>(to_right);
  std::vector<std::vector<char>>& of_input = levels_[parent.split_input];
  for (std::size_t level = 0; level < parent.level_side.size() && !of_input.empty(); ++level) {
    const int side = parent.level_side[level];
    char& left = of_input[parent.left][level];
    char& right = of_input[parent.right][level];
    left = static_cast<char>(left != 0 && (side < 0 || (side == 0 && to_left)));
    right = static_cast<char>(right != 0 && (side > 0 || (side == 0 && to_right)));
  }
}

double OrderedSplits::Geometry::half_width(int index) const { return half_width_of(node(index)); }

bool OrderedSplits::Geometry::meet(int left, int right, int but) const {
  for (int input = 0; input < inputs(); ++input) {
    if (input == but || (reaches_missing(left, input) && reaches_missing(right, input))) continue;
    if (!is_categorical(input)) {
      if (!(std::max(low(input, left), low(input, right)) < std::min(high(input, left), high(input, right)))) {
        return false;
      }
      continue;
    }
    bool common = false;
    for (int level = 0; level < levels(input) && !common; ++level) {
      common = reaches(left, input, level) && reaches(right, input, level);
    }
    if (!common) return false;
  }
  return true;
}

double OrderedSplits::Geometry::share(int leaf, int input, double from, double to) const {
  double count = 0.0;
  for (int at = parents_[leaf]; at >= 0; at = parents_[at]) {
    const double h = half_width(at);
    if (sign(at) != 0 && node(at).split_input == input && h > 0.0 && node(at).threshold - h < to &&
        node(at).threshold + h > from) {
      count += 1.0;
    }
  }
  return 1.0 / std::max(count, 1.0);
}

// As LocalModels::guarded().
OrderedSplits::Held OrderedSplits::Geometry::held(int leaf, Eigen::Index regressor, double deviation) const {
  const auto held_by = [&](int index) {
    return hold(deviation, node(index).low(regressor), node(index).high(regressor));
  };
  Held result{held_by(leaf), 0.0};
  double below = result.deviation;
  for (int at = parents_[leaf]; at >= 0 && below != deviation; at = parents_[at]) {
    const double reached = held_by(at);
    result.rest += node(at).slope(output_, regressor) * (reached - below);
    below = reached;
  }
  return result;
}

void OrderedSplits::Geometry::add_kinks(int leaf, Eigen::Index regressor, double low, double high,
                                        std::vector<double>& to) const {
  for (int at = leaf; at >= 0; at = parents_[at]) {
    const double first = node(at).low(regressor);
    const double last = node(at).high(regressor);
    const double round = rounding_of_hold * (last - first);
    for (const double kink : {first - round, first, last, last + round}) {
      if (kink > low && kink < high) {
        to.push_back(kink);
      }
    }
  }
}

}  // namespace llmt
