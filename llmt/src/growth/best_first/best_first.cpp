#include "growth/best_first/best_first.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <queue>

#include "base/count.hpp"
#include "base/parallel.hpp"
#include "growth/best_first/open_leaves.hpp"
#include "growth/gain_order.hpp"
#include "growth/pruning.hpp"

namespace llmt {
namespace {

// Weight of the prior in the m-estimates of RETIS, in rows: the error of one model for all data.
constexpr double prior_rows = 2.0;

// Whether the leaf's local model reproduces the outputs to rounding.
bool is_exact(const GrowthData& data, const OpenLeaf& leaf, const Node& node) {
  return (node.rss.array() <= leaf.weight * data.rounding.array().square()).all();
}

// Whether the residual variance rises by the best split of the leaf (docs/algorithms/growth.md, G.4).
bool raises_variance(const OpenLeaf& leaf, int rank) {
  const double freedom = leaf.weight - leaf.best.rank_left - leaf.best.rank_right;
  return !(freedom > 0.0 && leaf.best.rss / freedom <= leaf.rss / (leaf.weight - rank));
}

// Why the leaf's best split is not to be made, if so.
std::optional<StopReason> refusal(const GrowthData& data, const OpenLeaf& leaf, const Node& node) {
  const SplitCandidate& best = leaf.best;
  if (is_exact(data, leaf, node)) return StopReason::exact_fit;
  if (best.input < 0) return best.tested > 0 ? StopReason::significance : StopReason::leaf_samples;
  const GrowthOptions& options = data.problem.options;
  if (data.problem.criterion == SplitCriterion::smallest_rss) return std::nullopt;
  if (!data.is_significant(options.significance, leaf.weight, node.rank, leaf.rss, {best.rank_left, best.rank_right},
                           best.rss, best.tested)) {
    return StopReason::significance;
  }
  if (options.significance < every_split && raises_variance(leaf, node.rank)) return StopReason::variance_gain;
  return std::nullopt;
}

// From the scaled outputs of growth to the outputs' units.
void to_units_of_outputs(const GrowthData& data, Node& node) {
  node.rss = node.rss.cwiseProduct(data.output_scale).cwiseProduct(data.output_scale);
  node.value = node.value.cwiseProduct(data.output_scale) + data.output_mean;
  node.slope = data.output_scale.asDiagonal() * node.slope;
}

// A tree that grows by splitting the open leaf with the largest gain.
class BestFirstTree {
 public:
  explicit BestFirstTree(const GrowthProblem& problem) : data_(problem), open_(data_) {}

  GrownPartition grow();

 private:
  void open_root();
  StopReason split_leaves();
  void split(std::size_t position);
  void enter(OpenLeaf leaf);
  StopReason most_frequent_refusal() const;
  bool prune_by_m_estimates();

  GrowthData data_;
  OpenLeaves open_;
  std::vector<Node> nodes_;
  std::vector<double> gains_;  // of the nodes' splits, 0 for leaves
  std::vector<std::optional<OpenLeaf>> leaves_;
  std::priority_queue<ByGain<std::size_t>> queue_;  // positions in leaves_
  std::map<StopReason, Eigen::Index> refusals_;     // number of leaves that are not split, by reason
  SearchSummary search_;
};

GrownPartition BestFirstTree::grow() {
  open_root();
  StopReason stop = split_leaves();
  gains_.resize(nodes_.size(), 0.0);
  if (data_.problem.criterion == SplitCriterion::smallest_rss && prune_by_m_estimates()) stop = StopReason::pruning;
  for (Node& node : nodes_) {
    to_units_of_outputs(data_, node);
    node.missing_left = std::clamp(node.missing_left, 0.0, 1.0);
  }
  return {std::move(nodes_), stop, search_, std::move(gains_)};
}

void BestFirstTree::open_root() {
  const Eigen::Index regressors = std::ssize(data_.training.regressors);
  Node parentless;
  parentless.value = Eigen::VectorXd::Zero(data_.outputs.cols());
  parentless.slope = Eigen::MatrixXd::Zero(data_.outputs.cols(), regressors);
  parentless.mean = Eigen::VectorXd::Zero(regressors);
  nodes_.resize(1);
  OpenLeaf root = open_.root(parentless);
  open_.examine(root, parentless, nodes_[0]);
  data_.problem.searched(data_.training.count());
  enter(std::move(root));
}

StopReason BestFirstTree::split_leaves() {
  const Eigen::Index most = data_.problem.options.max_leaves;
  while (!queue_.empty()) {
    const Eigen::Index leaves = (std::ssize(nodes_) + 1) / 2;
    if (most > 0 && leaves >= most) return StopReason::max_leaves;
    const std::size_t next = queue_.top().content;
    queue_.pop();
    split(next);
  }
  return most_frequent_refusal();
}

void BestFirstTree::split(std::size_t position) {
  OpenLeaf leaf = std::move(*leaves_[position]);
  leaves_[position].reset();
  const Node parent = nodes_[leaf.node];
  auto [children, missing_left] = open_.divide(leaf, parent);
  for (OpenLeaf& child : children) {
    child.node = count_of(nodes_);
    nodes_.emplace_back();
  }
  parallel_for(2, data_.threads_for(parent.samples * data_.split_inputs()), [&, &parts = children](Eigen::Index side) {
    open_.examine(parts[side], parent, nodes_[parts[side].node]);
  });
  data_.problem.searched(parent.samples);
  gains_.resize(nodes_.size(), 0.0);
  gains_[leaf.node] = leaf.rss - leaf.best.rss;
  Node& node = nodes_[leaf.node];
  node.left = children[0].node;
  node.right = children[1].node;
  node.split_input = data_.problem.options.split_inputs[leaf.best.input];
  node.level_side = leaf.best.level_side;
  node.threshold = open_.threshold(leaf, node, nodes_[node.left], nodes_[node.right]);
  node.missing_left = missing_left;
  for (OpenLeaf& child : children) {
    enter(std::move(child));
  }
}

// Puts an examined leaf into the queue, or counts why it is not split.
void BestFirstTree::enter(OpenLeaf leaf) {
  search_.evaluations += leaf.best.evaluations;
  if (std::holds_alternative<BinnedLeaf>(leaf.data)) {
    ++search_.binned_nodes;
    search_.largest_excess = std::max(search_.largest_excess, leaf.rss > 0.0 ? leaf.excess / leaf.rss : 0.0);
  } else if (data_.problem.criterion != SplitCriterion::residual_signs) {
    ++search_.exact_nodes;
  }
  open_.wait(leaf);
  if (const std::optional<StopReason> reason = refusal(data_, leaf, nodes_[leaf.node])) {
    ++refusals_[*reason];
    return;
  }
  queue_.push({static_cast<float>(leaf.rss - leaf.best.rss), leaf.node, leaves_.size()});
  leaves_.emplace_back(std::move(leaf));
}

// If several reasons are equally frequent, the first one in StopReason.
StopReason BestFirstTree::most_frequent_refusal() const {
  const auto fewer = [](const auto& a, const auto& b) { return a.second < b.second; };
  return std::ranges::max_element(refusals_, fewer)->first;
}

// True if pruning removed a split.
bool BestFirstTree::prune_by_m_estimates() {
  const std::vector<double> grown = std::move(gains_);
  const std::vector<std::size_t> kept = prune(nodes_, data_.output_weights, prior_rows);
  gains_.assign(kept.size(), 0.0);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    if (!nodes_[i].is_leaf()) gains_[i] = grown[kept[i]];
  }
  return kept.size() < grown.size();
}

}  // namespace

GrownPartition grow(const GrowthProblem& problem) { return BestFirstTree(problem).grow(); }

}  // namespace llmt
