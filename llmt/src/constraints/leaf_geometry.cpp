#include "constraints/leaf_geometry.hpp"

#include <algorithm>

#include "constraints/monotone_splits.hpp"
#include "model/hold.hpp"
#include "model/tree.hpp"

namespace llmt {

LeafGeometry::LeafGeometry(const Partition& partition, const TrainingRows& training, Eigen::Index output)
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
  for (int i = 0; i < std::ssize(partition.nodes); ++i) {
    signs_.push_back(ordered_sign(partition.nodes[i], training));
    hand_down(i);
  }
}

// Sets which levels, and whether missing values, reach the children of a node.
void LeafGeometry::hand_down(int index) {
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

double LeafGeometry::half_width(int index) const { return half_width_of(node(index)); }

bool LeafGeometry::meet(int left, int right, int but) const {
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

double LeafGeometry::slope_share(int leaf, int input, double from, double to) const {
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

ClampedDeviation LeafGeometry::clamped(int leaf, Eigen::Index regressor, double deviation) const {
  const auto clamped_by = [&](int index) {
    return hold(deviation, node(index).low(regressor), node(index).high(regressor));
  };
  ClampedDeviation result{clamped_by(leaf), 0.0};
  double below = result.deviation;
  int left = most_ancestors;
  for (int at = next_ancestor(parents_, leaf, left); at >= 0 && below != deviation;
       at = next_ancestor(parents_, at, left)) {
    const double reached = clamped_by(at);
    result.rest += node(at).slope(output_, regressor) * (reached - below);
    below = reached;
  }
  return result;
}

void LeafGeometry::add_kinks(int leaf, Eigen::Index regressor, double low, double high, std::vector<double>& to) const {
  int left = most_ancestors;
  for (int at = leaf; at >= 0; at = next_ancestor(parents_, at, left)) {
    const double first = node(at).low(regressor);
    const double last = node(at).high(regressor);
    const double round = rounding_of_hold * (last - first);
    for (const double kink : {first - round, first, last, last + round}) {
      if (kink > low && kink < high) to.push_back(kink);
    }
  }
}

}  // namespace llmt
