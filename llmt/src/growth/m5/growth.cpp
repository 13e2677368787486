#include "growth/m5/growth.hpp"

#include <limits>
#include <queue>

#include "base/count.hpp"
#include "data/missing.hpp"
#include "growth/gain_order.hpp"
#include "growth/m5/pruning.hpp"
#include "growth/m5/tree.hpp"
#include "model/imputed.hpp"
#include "numerics/node_fit.hpp"

namespace llmt {
namespace {

// Rows that the model of a node counts as when the model of its child is drawn towards it (Quinlan 1992).
constexpr double smoothing_rows = 15.0;

// The smoothed model of a node (docs/algorithms/m5.md, Q.3).
M5Model smoothed(const M5Tree& tree, int index) {
  const M5Branch* child = &tree.branches[index];
  M5Model result = child->model;
  for (int at = child->parent; at >= 0; at = child->parent) {
    const M5Branch& ancestor = tree.branches[at];
    const double share = child->weight / (child->weight + smoothing_rows);
    result.value = share * result.value + (1.0 - share) * ancestor.model.value;
    result.slope = share * result.slope + (1.0 - share) * ancestor.model.slope;
    child = &ancestor;
  }
  return result;
}

// A leaf with the smoothed model of a branch, in the outputs' units.
Node make_node(const GrowthData& data, const RowMajor& deviations, M5Tree& tree, int index) {
  const std::span<int> own = tree.rows_of(tree.branches[index]);
  const std::vector<int> rows(own.begin(), own.end());
  const Eigen::VectorXd weights = data.weights(rows);
  const RowMajor x = deviations(rows, Eigen::all);
  const Eigen::MatrixXd y = data.outputs(rows, Eigen::all);
  const NodeFit fit = fit_node(x, y, weights);
  const M5Model model = smoothed(tree, index);
  Node node;
  node.samples = std::ssize(rows);
  node.rank = fit.rank;
  node.mean = fit.mean;
  node.low = fit.low;
  node.high = fit.high;
  const RowMajor known = imputed(x, fit.mean);
  const Eigen::MatrixXd left_over =
      (y - known * model.slope.transpose()).rowwise() - Eigen::RowVectorXd(model.value.transpose());
  node.rss = (weights.transpose() * left_over.cwiseAbs2()).transpose().cwiseProduct(data.output_scale.cwiseAbs2());
  node.value = model.value.cwiseProduct(data.output_scale) + data.output_mean;
  node.slope = data.output_scale.asDiagonal() * model.slope;
  return node;
}

void set_split(const GrowthData& data, const M5Branch& branch, Node& node) {
  node.split_input = data.problem.options.split_inputs[branch.split.input];
  node.threshold = branch.split.by_missing ? std::numeric_limits<double>::max() : branch.split.threshold;
  node.level_side = branch.split.level_side;
  node.missing_left = branch.missing_left;
}

// The pruned tree, its splits in the order of best-first growth: the largest decrease first.
GrownPartition in_order_of_growth(const GrowthData& data, const RowMajor& deviations, M5Tree& tree) {
  GrownPartition result;
  std::priority_queue<ByGain<int>> queue;  // branches
  const auto enter = [&](int index) {
    const M5Branch& branch = tree.branches[index];
    if (branch.left >= 0) {
      queue.push({static_cast<float>(branch.split.decrease), count_of(result.nodes), index});
    }
    result.nodes.push_back(make_node(data, deviations, tree, index));
  };
  enter(0);
  const Eigen::Index most = data.problem.options.max_leaves;
  while (!queue.empty()) {
    if (most > 0 && (std::ssize(result.nodes) + 1) / 2 >= most) {
      result.stop = StopReason::max_leaves;
      break;
    }
    const ByGain<int> next = queue.top();
    queue.pop();
    const M5Branch& branch = tree.branches[next.content];
    Node& node = result.nodes[next.node];
    node.left = count_of(result.nodes);
    node.right = node.left + 1;
    set_split(data, branch, node);
    enter(branch.left);
    enter(branch.right);
  }
  return result;
}

}  // namespace

GrownPartition grow_m5(const GrowthProblem& problem) {
  const GrowthData data(problem);
  const RowMajor deviations = all_deviations(data.training);
  M5Tree tree = grow_m5_tree(data);
  const bool pruned = prune_m5_tree(data, deviations, tree);
  GrownPartition result = in_order_of_growth(data, deviations, tree);
  if (pruned && result.stop != StopReason::max_leaves) result.stop = StopReason::pruning;
  return result;
}

}  // namespace llmt
