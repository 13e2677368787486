#include "growth/best_first/best_first.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <queue>
#include <variant>

#include "base/parallel.hpp"
#include "growth/best_first/binned_leaves.hpp"
#include "growth/best_first/exact_leaves.hpp"
#include "growth/best_first/residual_leaves.hpp"
#include "growth/pruning.hpp"
#include "model/evaluator.hpp"

namespace llmt {
namespace {

// From this many rows on, inputs are cut into bins; nodes below the other number of rows are searched exactly even
// then, and by RA have features of their own. bench/search_modes prints where these pay.
constexpr Eigen::Index binned_rows = 200000;
constexpr Eigen::Index exact_rows = 2000;

// Weight of the prior in the m-estimates of RETIS, in rows: the error of one model for all data.
constexpr double prior_rows = 2.0;

// Splits over which GrowthOptions::min_improvement takes the mean: one split alone may help little before the next one
// helps much.
constexpr Eigen::Index improvement_lookahead = 10;

// A node that may still be split.
struct OpenLeaf {
  int node = 0;
  std::variant<ExactLeaf, BinnedLeaf, SignLeaf> data;
  double weight = 0.0;  // of its rows
  double rss = 0.0;     // weighted
  SplitCandidate best;  // input: position among the split inputs
  double excess = 0.0;  // that a split inside a bin could gain on it
};

// Which open leaf comes next: the largest gain, then the oldest node. The gain is compared in single precision, so
// that gains that are equal but for rounding count as equal.
struct Priority {
  float gain;
  int node;
  std::size_t leaf;
  bool operator<(const Priority& other) const { return gain != other.gain ? gain < other.gain : node > other.node; }
};

bool by_bins(const GrowthData& data) {
  if (data.problem.options.rule == GrowthRule::ra) return false;
  switch (data.problem.options.search) {
    case SplitSearch::exact:
      return false;
    case SplitSearch::binned:
      return BinnedLeaves::possible(data);
    case SplitSearch::automatic:
      break;
  }
  return data.training.count() >= binned_rows && BinnedLeaves::possible(data);
}

class Grower {
 public:
  explicit Grower(const GrowthProblem& problem) : options_(problem.options), data_(problem), exact_(data_) {
    if (by_bins(data_)) {
      binned_.emplace(data_);
    } else if (options_.rule == GrowthRule::ra && data_.training.count() >= exact_rows && is_complete(data_)) {
      signs_.emplace(data_);
    }
  }

  GrownPartition run() {
    open_root();
    StopReason stop = StopReason::leaf_samples;
    bool stopped = false;
    while (!queue_.empty()) {
      const Priority next = queue_.top();
      if (options_.max_leaves > 0 && (std::ssize(nodes_) + 1) / 2 >= options_.max_leaves) {
        stop = StopReason::max_leaves;
        stopped = true;
        break;
      }
      if (improves_too_little()) {
        drop_lookahead();
        stop = StopReason::improvement;
        stopped = true;
        break;
      }
      queue_.pop();
      split(next.leaf);
    }
    if (!stopped) {
      stop = static_cast<StopReason>(std::ranges::max_element(refusals_) - refusals_.begin());
    }
    gains_.resize(nodes_.size(), 0.0);
    if (options_.rule == GrowthRule::retis) {
      const std::vector<std::size_t> kept = prune(nodes_, data_.output_weights, prior_rows);
      stop = kept.size() < gains_.size() ? StopReason::pruning : stop;
      for (std::size_t i = 0; i < kept.size(); ++i) {
        gains_[i] = nodes_[i].is_leaf() ? 0.0 : gains_[kept[i]];
      }
      gains_.resize(kept.size());
    }
    for (Node& node : nodes_) {
      node.rss = node.rss.cwiseProduct(data_.output_scale).cwiseProduct(data_.output_scale);
      node.value = node.value.cwiseProduct(data_.output_scale) + data_.output_mean;
      node.slope = data_.output_scale.asDiagonal() * node.slope;
      node.missing_left = std::clamp(node.missing_left, 0.0, 1.0);
    }
    return {std::move(nodes_), stop, search_, std::move(gains_)};
  }

 private:
  void open_root() {
    const Eigen::Index regressors = std::ssize(data_.training.regressors);
    Node parentless;
    parentless.value = Eigen::VectorXd::Zero(data_.outputs.cols());
    parentless.slope = Eigen::MatrixXd::Zero(data_.outputs.cols(), regressors);
    parentless.mean = Eigen::VectorXd::Zero(regressors);
    nodes_.resize(1);
    OpenLeaf root;
    if (binned_) {
      root.data = binned_->root();
    } else if (signs_) {
      root.data = signs_->root();
    } else {
      std::vector<int> rows(data_.training.count());
      std::iota(rows.begin(), rows.end(), 0);
      root.data = exact_.open(rows, parentless);
    }
    examine(root, parentless);
    tree_rss_ = {root.rss};
    enter(std::move(root));
  }

  // Fits the leaf's local model and finds its best split.
  void examine(OpenLeaf& leaf, const Node& parent) {
    Node& node = nodes_[leaf.node];
    if (BinnedLeaf* const binned = std::get_if<BinnedLeaf>(&leaf.data)) {
      leaf.best = binned_->examine(*binned, parent, node, leaf.excess);
      leaf.weight = binned->weight;
    } else if (SignLeaf* const signs = std::get_if<SignLeaf>(&leaf.data)) {
      leaf.best = signs_->examine(*signs, parent, node);
      leaf.weight = signs->weight;
    } else {
      ExactLeaf& exact = std::get<ExactLeaf>(leaf.data);
      leaf.best = exact_.examine(exact, parent, node);
      leaf.weight = exact.weights.sum();
    }
    leaf.rss = data_.output_weights.dot(node.rss);
  }

  // Why the leaf's best split is not to be made, if so.
  std::optional<StopReason> refusal(const OpenLeaf& leaf) const {
    const Node& node = nodes_[leaf.node];
    const double samples = leaf.weight;
    if ((node.rss.array() <= samples * data_.rounding.array().square()).all()) {
      return StopReason::exact_fit;
    }
    if (leaf.best.input < 0) {
      return leaf.best.tested > 0 ? StopReason::significance : StopReason::leaf_samples;
    }
    if (options_.rule == GrowthRule::retis) return std::nullopt;
    if (!data_.is_significant(options_.significance, samples, node.rank, leaf.rss,
                              {leaf.best.rank_left, leaf.best.rank_right}, leaf.best.rss, leaf.best.tested)) {
      return StopReason::significance;
    }
    if (options_.min_variance_gain >= 0.0) {
      // The weights make the outputs' sums of squares 1 each, so that (rows - 1) times a residual variance is a
      // fraction of the variance.
      const double to_fraction = (data_.weights.sum() - 1.0) / static_cast<double>(data_.output_weights.size());
      const double freedom = samples - leaf.best.rank_left - leaf.best.rank_right;
      const double before = leaf.rss / (samples - node.rank);
      const double after = leaf.best.rss / freedom;
      if (freedom <= 0.0 || !((before - after) * to_fraction >= options_.min_variance_gain)) {
        return StopReason::variance_gain;
      }
    }
    return std::nullopt;
  }

  bool improves_too_little() const {
    const std::size_t lookahead = improvement_lookahead;
    if (!(options_.min_improvement > 0.0) || tree_rss_.size() <= lookahead) return false;
    const double before = tree_rss_[tree_rss_.size() - 1 - lookahead];
    return tree_rss_.back() > std::pow(1.0 - options_.min_improvement, static_cast<double>(lookahead)) * before;
  }

  // Undoes the last splits, those that showed that going on does not pay.
  void drop_lookahead() {
    const Eigen::Index leaves = std::ssize(tree_rss_) - improvement_lookahead;
    nodes_ = prefix(Partition{.outputs = {}, .nodes = std::move(nodes_)}, leaves).nodes;
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      gains_[i] = nodes_[i].is_leaf() ? 0.0 : gains_[i];
    }
  }

  void enter(OpenLeaf leaf) {
    search_.evaluations += leaf.best.evaluations;
    if (BinnedLeaf* const binned = std::get_if<BinnedLeaf>(&leaf.data)) {
      ++search_.binned_nodes;
      search_.largest_excess = std::max(search_.largest_excess, leaf.rss > 0.0 ? leaf.excess / leaf.rss : 0.0);
      binned_->wait(*binned);
    } else if (options_.rule != GrowthRule::ra) {
      ++search_.exact_nodes;
    }
    if (const std::optional<StopReason> reason = refusal(leaf)) {
      ++refusals_[static_cast<std::size_t>(*reason)];
      return;
    }
    const float gain = static_cast<float>(leaf.rss - leaf.best.rss);
    queue_.push({gain, leaf.node, leaves_.size()});
    leaves_.emplace_back(std::move(leaf));
  }

  void split(std::size_t position) {
    OpenLeaf leaf = std::move(*leaves_[position]);
    leaves_[position].reset();
    const Node parent = nodes_[leaf.node];
    std::array<OpenLeaf, 2> children;
    double missing_left = 0.0;
    divide(leaf, parent, children, missing_left);
    for (OpenLeaf& child : children) {
      child.node = static_cast<int>(nodes_.size());
      nodes_.emplace_back();
    }
    parallel_for(2, data_.threads_for(parent.samples * data_.split_inputs()),
                 [&](Eigen::Index side) { examine(children[side], parent); });
    Node& node = nodes_[leaf.node];
    gains_.resize(nodes_.size(), 0.0);
    gains_[leaf.node] = leaf.rss - leaf.best.rss;
    node.left = children[0].node;
    node.right = children[1].node;
    node.split_input = options_.split_inputs[leaf.best.input];
    node.level_side = leaf.best.level_side;
    node.threshold = leaf.best.by_missing ? std::numeric_limits<double>::max() : 0.0;
    if (!leaf.best.by_missing && node.level_side.empty()) {
      node.threshold = threshold(leaf);
    }
    node.missing_left = missing_left;
    tree_rss_.push_back(tree_rss_.back() - (leaf.rss - children[0].rss - children[1].rss));
    for (OpenLeaf& child : children) {
      enter(std::move(child));
    }
  }

  void divide(OpenLeaf& leaf, const Node& parent, std::array<OpenLeaf, 2>& children, double& missing_left) {
    if (BinnedLeaf* const binned = std::get_if<BinnedLeaf>(&leaf.data)) {
      missing_left = open_parts(*binned, binned_->divide(*binned, leaf.best), parent, children);
      return;
    }
    if (SignLeaf* const signs = std::get_if<SignLeaf>(&leaf.data)) {
      missing_left = open_parts(*signs, signs_->divide(*signs, leaf.best), parent, children);
      return;
    }
    ExactLeaves::Children parts = exact_.divide(std::get<ExactLeaf>(leaf.data), parent, leaf.best);
    missing_left = parts.missing_left;
    for (std::size_t side = 0; side < 2; ++side) {
      children[side].data = std::move(parts.leaves[side]);
    }
  }

  // Small parts go on as exact leaves. Returns the left one's share of the rows.
  template <class Leaf>
  double open_parts(const Leaf& leaf, std::array<Leaf, 2> parts, const Node& parent,
                    std::array<OpenLeaf, 2>& children) const {
    const double share = static_cast<double>(parts[0].rows.size()) / static_cast<double>(leaf.rows.size());
    for (std::size_t side = 0; side < 2; ++side) {
      if (std::ssize(parts[side].rows) < exact_rows) {
        children[side].data = exact_.open(parts[side].rows, parent);
      } else {
        children[side].data = std::move(parts[side]);
      }
    }
    return share;
  }

  double threshold(const OpenLeaf& leaf) const {
    const Node& node = nodes_[leaf.node];
    const Node& left = nodes_[node.left];
    const Node& right = nodes_[node.right];
    if (const BinnedLeaf* const binned = std::get_if<BinnedLeaf>(&leaf.data)) {
      return binned_->threshold(*binned, leaf.best, node, left, right);
    }
    if (const SignLeaf* const signs = std::get_if<SignLeaf>(&leaf.data)) {
      return signs_->threshold(*signs, leaf.best, node, left, right);
    }
    return exact_.threshold(std::get<ExactLeaf>(leaf.data), leaf.best, node, left, right);
  }

  const GrowthOptions& options_;
  GrowthData data_;
  ExactLeaves exact_;
  std::optional<BinnedLeaves> binned_;
  std::optional<SignLeaves> signs_;
  std::vector<Node> nodes_;
  std::vector<std::optional<OpenLeaf>> leaves_;
  std::priority_queue<Priority> queue_;
  std::array<Eigen::Index, 9> refusals_{};  // leaves that stay, by StopReason
  std::vector<double> tree_rss_;            // weighted, with 1, 2, ... leaves
  std::vector<double> gains_;               // of the nodes' splits
  SearchSummary search_;
};

}  // namespace

GrownPartition grow(const GrowthProblem& problem) { return Grower(problem).run(); }

}  // namespace llmt
