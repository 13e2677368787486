#include "growth/best_first/exact_leaves.hpp"

#include <algorithm>
#include <cmath>

#include "base/count.hpp"
#include "base/parallel.hpp"
#include "growth/best_first/division.hpp"
#include "growth/best_first/exact_search.hpp"
#include "model/imputed.hpp"
#include "model/leaf_validities.hpp"
#include "numerics/node_fit.hpp"

namespace llmt {
namespace {

using Rows = std::vector<int>;

struct ValueOfRow {
  double value;
  int position;
  bool operator<(const ValueOfRow& other) const {
    return value != other.value ? value < other.value : position < other.position;
  }
};

// The rows of a leaf that take part in one of its children.
struct Part {
  Rows positions;          // among the leaf's rows
  Rows position_in_child;  // of each of the leaf's rows; -1: it takes no part
  std::vector<double> weights;
};

// `share`: validity of the child for rows without a value. A row that belongs to the other child in part would distort
// the child's local model, so it takes no part.
Part part_of(const ExactLeaf& leaf, const std::vector<Side>& sides, Side own, double share) {
  Part part;
  part.position_in_child.assign(sides.size(), -1);
  for (int k = 0; k < std::ssize(sides); ++k) {
    const double validity = sides[k] == Side::both ? share : 1.0;
    if ((sides[k] != own && sides[k] != Side::both) || validity < clear_share) continue;
    part.position_in_child[k] = count_of(part.positions);
    part.positions.push_back(k);
    part.weights.push_back(validity * leaf.weights(k));
  }
  return part;
}

ExactLeaf child_of(const ExactLeaf& leaf, const Part& part) {
  ExactLeaf child;
  child.weights = Eigen::Map<const Eigen::VectorXd>(part.weights.data(), std::ssize(part.weights));
  child.inputs = leaf.inputs(part.positions, Eigen::all);
  child.residuals = leaf.residuals(part.positions, Eigen::all);
  child.orders.resize(leaf.orders.size());
  for (std::size_t j = 0; j < leaf.orders.size(); ++j) {
    child.orders[j].reserve(part.positions.size());
    for (const int k : leaf.orders[j]) {
      if (const int position = part.position_in_child[k]; position >= 0) child.orders[j].push_back(position);
    }
  }
  return child;
}

}  // namespace

RowMajor deviations_in(const GrowthData& data, const ExactLeaf& leaf) {
  const std::vector<Regressor>& regressors = data.training.regressors;
  RowMajor result(leaf.inputs.rows(), std::ssize(regressors));
  for (Eigen::Index row = 0; row < result.rows(); ++row) {
    deviations_at(data.training.columns, regressors, leaf.inputs.row(row).data(), result.row(row).data());
  }
  return result;
}

std::vector<int> levels_in(const GrowthData& data, const ExactLeaf& leaf, Eigen::Index split_input) {
  std::vector<int> levels;
  for (Eigen::Index row = 0; row < leaf.inputs.rows(); ++row) {
    const double value = leaf.split_value(data, row, split_input);
    levels.push_back(std::isnan(value) ? -1 : static_cast<int>(value));
  }
  return levels;
}

ExactLeaf ExactLeaves::open(const Rows& rows, const Node& parent) const {
  ExactLeaf leaf;
  leaf.inputs = inputs_of(data_.training, rows);
  leaf.weights = data_.weights(rows);
  // Missing values are taken at the mean of the parent's rows, as they were in its fit.
  RowMajor x = deviations_in(data_, leaf);
  if (data_.training.has_missing) x = imputed(x, parent.mean);
  leaf.residuals = data_.outputs(rows, Eigen::all) - x * parent.slope.transpose();
  leaf.residuals.rowwise() -= parent.value.transpose();
  leaf.orders.resize(data_.split_inputs());
  if (by_residuals()) return leaf;
  parallel_for(data_.split_inputs(), data_.threads_for(std::ssize(rows)), [&](Eigen::Index j) {
    data_.problem.check(std::ssize(rows));
    if (data_.num_levels[j] == 0) leaf.orders[j] = sorted_rows(leaf, j);
  });
  return leaf;
}

Rows ExactLeaves::sorted_rows(const ExactLeaf& leaf, Eigen::Index split_input) const {
  std::vector<ValueOfRow> values;
  values.reserve(leaf.inputs.rows());
  for (int k = 0; k < leaf.inputs.rows(); ++k) {
    if (const double value = leaf.split_value(data_, k, split_input); !std::isnan(value)) {
      values.push_back({value, k});
    }
  }
  std::sort(values.begin(), values.end());
  Rows order(values.size());
  std::ranges::transform(values, order.begin(), [](const ValueOfRow& entry) { return entry.position; });
  return order;
}

SplitCandidate ExactLeaves::examine(ExactLeaf& leaf, const Node& parent, Node& node) const {
  const RowMajor x = deviations_in(data_, leaf);
  const NodeFit fit = data_.training.has_missing
                          ? fit_node(x, about_own_mean(x, parent, leaf.residuals, leaf.weights), leaf.weights)
                          : fit_node(x, leaf.residuals, leaf.weights);
  node.samples = leaf.inputs.rows();
  node.rank = fit.rank;
  node.rss = fit.rss;
  node.value = parent.value + fit.centre_change;
  node.slope = parent.slope + fit.slope_change;
  node.mean = fit.mean;
  node.low = fit.low;
  node.high = fit.high;
  leaf.residuals = fit.residuals();
  return find_split(data_, leaf, fit, data_.output_weights.dot(node.rss));
}

ExactLeaves::Children ExactLeaves::divide(const ExactLeaf& leaf, const Node& node, const SplitCandidate& split) const {
  const std::vector<Side> sides = sides_of(data_, leaf, split);
  Children children;
  children.missing_left = split.by_missing ? 0.0 : learn_missing_left(data_, leaf, node, sides);
  children.leaves[0] = child_of(leaf, part_of(leaf, sides, Side::left, children.missing_left));
  children.leaves[1] = child_of(leaf, part_of(leaf, sides, Side::right, 1.0 - children.missing_left));
  return children;
}

double ExactLeaves::threshold(const ExactLeaf& leaf, const SplitCandidate& split, const Node& node, const Node& left,
                              const Node& right) const {
  Rows order = leaf.orders[split.input];
  if (by_residuals()) {
    // The rows that go left come first, as in a sorted order.
    const std::vector<Side> sides = sides_of(data_, leaf, split);
    for (const Side side : {Side::left, Side::right}) {
      for (int k = 0; k < std::ssize(sides); ++k) {
        if (sides[k] == side) order.push_back(k);
      }
    }
  }
  Eigen::VectorXd values(std::ssize(order));
  std::ranges::transform(order, values.begin(), [&](int row) { return leaf.split_value(data_, row, split.input); });
  // The regression of the child models' difference on the split input over the node's rows says how far apart they are,
  // on average, on the plane x_j = t: a + b (t - mean).
  const Eigen::VectorXd weights = leaf.weights(order);
  RowMajor x = deviations_in(data_, leaf)(order, Eigen::all);
  if (data_.training.has_missing) x = imputed(x, node.mean);
  const Eigen::MatrixXd apart = (x * (right.slope - left.slope).transpose()).rowwise() +
                                Eigen::RowVectorXd((right.value - left.value).transpose());
  const double mean = weights.dot(values) / weights.sum();
  const Eigen::VectorXd centred = values.array() - mean;
  const Eigen::VectorXd weighted = centred.cwiseProduct(weights);
  const Eigen::VectorXd b = apart.transpose() * weighted / weighted.dot(centred);
  const Eigen::VectorXd a = apart.transpose() * weights / weights.sum();
  const Eigen::Index right_rows = values.size() - split.left;
  return data_.place_threshold(values.head(split.left).maxCoeff(), values.tail(right_rows).minCoeff(), mean, a, b);
}

}  // namespace llmt
