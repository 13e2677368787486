#include "growth.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <queue>

#include "f_distribution.hpp"
#include "node_fit.hpp"
#include "parallel.hpp"
#include "pruning.hpp"
#include "split_search.hpp"

namespace llmt {
namespace {

using Rows = std::vector<int>;

/// A node that may still be split.
struct OpenLeaf {
  int node = 0;
  Rows rows;                  // ascending
  std::vector<Rows> orders;   // the rows sorted by each split input, ties by row
  Eigen::MatrixXd residuals;  // of the node's local model, one row per entry of `rows`
  double rss = 0.0;           // weighted
  SplitCandidate best;        // input: position among the split inputs
};

/// Which open leaf comes next: the largest gain, then the oldest node. The gain is compared in single precision, so
/// that gains that are equal but for rounding count as equal.
struct Priority {
  float gain;
  int node;
  std::size_t leaf;
  bool operator<(const Priority& other) const { return gain != other.gain ? gain < other.gain : node > other.node; }
};

class Grower {
 public:
  explicit Grower(const GrowthProblem& problem)
      : problem_(problem), options_(problem.options), local_row_(static_cast<std::size_t>(problem.outputs.rows())) {
    scale_outputs();
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
      stop = static_cast<StopReason>(std::max_element(refusals_.begin(), refusals_.end()) - refusals_.begin());
    }
    if (options_.rule == GrowthRule::retis && options_.pruning_m > 0.0 && prune(nodes_, weights_, options_.pruning_m)) {
      stop = StopReason::pruning;
    }
    for (Node& node : nodes_) {
      node.rss = node.rss.cwiseProduct(output_scale_).cwiseProduct(output_scale_);
      node.value = node.value.cwiseProduct(output_scale_) + output_mean_;
      node.slope = output_scale_.asDiagonal() * node.slope;
    }
    return {std::move(nodes_), stop};
  }

 private:
  /// Outputs about their mean, divided by a power of two near their largest deviation: a target of scale 1e-6 and one
  /// with offset 1e8 look alike from here on, and dividing by a power of two rounds nothing.
  void scale_outputs() {
    const Eigen::MatrixXd& outputs = problem_.outputs;
    output_mean_ = outputs.colwise().sum().transpose() / static_cast<double>(outputs.rows());
    scaled_outputs_ = outputs.rowwise() - Eigen::RowVectorXd(output_mean_.transpose());
    output_scale_.resize(outputs.cols());
    weights_.resize(outputs.cols());
    rounding_.resize(outputs.cols());
    for (std::ptrdiff_t o = 0; o < outputs.cols(); ++o) {
      const double largest = scaled_outputs_.col(o).cwiseAbs().maxCoeff();
      output_scale_(o) = largest > 0.0 ? std::exp2(std::ilogb(largest)) : 1.0;
      scaled_outputs_.col(o) /= output_scale_(o);
      const double sum_of_squares = scaled_outputs_.col(o).squaredNorm();
      weights_(o) = sum_of_squares > 0.0 ? 1.0 / sum_of_squares : 1.0;
      rounding_(o) =
          8.0 * std::numeric_limits<double>::epsilon() * outputs.col(o).cwiseAbs().maxCoeff() / output_scale_(o);
    }
  }

  void open_root() {
    OpenLeaf root;
    root.rows.resize(static_cast<std::size_t>(problem_.outputs.rows()));
    std::iota(root.rows.begin(), root.rows.end(), 0);
    root.orders.assign(static_cast<std::size_t>(problem_.split_values.cols()), root.rows);
    parallel_for(std::ssize(root.orders), problem_.max_threads, [&](std::ptrdiff_t j) {
      const Eigen::MatrixXd& values = problem_.split_values;
      std::stable_sort(root.orders[static_cast<std::size_t>(j)].begin(), root.orders[static_cast<std::size_t>(j)].end(),
                       [&](int a, int b) { return values(a, j) < values(b, j); });
    });
    Node parentless;
    parentless.value = Eigen::VectorXd::Zero(problem_.outputs.cols());
    parentless.slope = Eigen::MatrixXd::Zero(problem_.outputs.cols(), problem_.deviations.cols());
    nodes_.resize(1);
    const NodeFit fit = fit_leaf(root, parentless, scaled_outputs_);
    tree_rss_ = {root.rss};
    find_split(root, fit);
    enter(std::move(root));
  }

  /// Fits the local model of `leaf` as a correction of its parent's, whose residuals on the leaf's rows are given.
  NodeFit fit_leaf(OpenLeaf& leaf, const Node& parent, const Eigen::MatrixXd& parent_residuals) {
    NodeFit fit = fit_node(problem_.deviations(leaf.rows, Eigen::all), parent_residuals);
    Node& node = nodes_[static_cast<std::size_t>(leaf.node)];
    node.samples = std::ssize(leaf.rows);
    node.rank = fit.rank;
    node.rss = fit.rss;
    node.value = parent.value + fit.centre_change;
    node.slope = parent.slope + fit.slope_change;
    leaf.residuals = fit.residuals;
    leaf.rss = weights_.dot(fit.rss);
    return fit;
  }

  /// Searches all split inputs; leaves in leaf.best the best split, acceptable or not.
  void find_split(OpenLeaf& leaf, const NodeFit& fit) {
    if (std::ssize(leaf.rows) < 2 * options_.min_leaf_samples) {
      return;
    }
    const SearchNode node = make_search_node(fit, weights_);
    for (std::size_t local = 0; local < leaf.rows.size(); ++local) {
      local_row_[static_cast<std::size_t>(leaf.rows[local])] = static_cast<int>(local);
    }
    std::vector<SplitCandidate> found(leaf.orders.size());
    parallel_for(std::ssize(found), problem_.max_threads, [&](std::ptrdiff_t j) {
      const Rows& order = leaf.orders[static_cast<std::size_t>(j)];
      Rows local(order.size());
      std::vector<double> values(order.size());
      for (std::size_t k = 0; k < order.size(); ++k) {
        local[k] = local_row_[static_cast<std::size_t>(order[k])];
        values[k] = problem_.split_values(order[k], j);
      }
      found[static_cast<std::size_t>(j)] = search_input(node, values, local, options_.min_leaf_samples);
    });
    std::ptrdiff_t tested = 0;
    for (std::size_t j = 0; j < found.size(); ++j) {
      tested += found[j].tested;
      if (found[j].input >= 0 && (leaf.best.input < 0 || found[j].rss < leaf.best.rss - tie_tolerance * leaf.rss)) {
        leaf.best = found[j];
        leaf.best.input = static_cast<int>(j);
      }
    }
    leaf.best.tested = tested;
  }

  /// Why the leaf's best split is not to be made, if so.
  std::optional<StopReason> refusal(const OpenLeaf& leaf) const {
    const Node& node = nodes_[static_cast<std::size_t>(leaf.node)];
    const double samples = static_cast<double>(node.samples);
    if ((node.rss.array() <= samples * rounding_.array().square()).all()) {
      return StopReason::exact_fit;
    }
    if (leaf.best.input < 0) {
      return StopReason::leaf_samples;
    }
    if (options_.rule == GrowthRule::retis) {
      return std::nullopt;
    }
    // Several outputs count as that many independent observations of equal variance, which the weights make them at the
    // root.
    const double outputs = static_cast<double>(weights_.size());
    const double added = outputs * (leaf.best.rank_left + leaf.best.rank_right - node.rank);
    const double freedom = outputs * (samples - leaf.best.rank_left - leaf.best.rank_right);
    if (options_.significance < 1.0) {
      if (added <= 0.0 || freedom <= 0.0) {
        return StopReason::significance;
      }
      const double f = ((leaf.rss - leaf.best.rss) / added) / (leaf.best.rss / freedom);
      if (f_survival(f, added, freedom) * static_cast<double>(leaf.best.tested) >= options_.significance) {
        return StopReason::significance;
      }
    }
    if (options_.min_variance_gain >= 0.0) {
      // The weights make the outputs' sums of squares 1 each, so that (rows - 1) times a residual variance is a
      // fraction of the variance.
      const double to_fraction = static_cast<double>(problem_.outputs.rows() - 1) / outputs;
      const double before = leaf.rss / (samples - node.rank);
      const double after = leaf.best.rss / (freedom / outputs);
      if (freedom <= 0.0 || !((before - after) * to_fraction >= options_.min_variance_gain)) {
        return StopReason::variance_gain;
      }
    }
    return std::nullopt;
  }

  bool improves_too_little() const {
    const std::size_t lookahead = static_cast<std::size_t>(improvement_lookahead);
    if (!(options_.min_improvement > 0.0) || tree_rss_.size() <= lookahead) {
      return false;
    }
    const double before = tree_rss_[tree_rss_.size() - 1 - lookahead];
    return tree_rss_.back() > std::pow(1.0 - options_.min_improvement, static_cast<double>(lookahead)) * before;
  }

  /// Undoes the last splits, those that showed that going on does not pay.
  void drop_lookahead() {
    const std::ptrdiff_t leaves = std::ssize(tree_rss_) - improvement_lookahead;
    nodes_ = prefix(Partition{.outputs = {}, .nodes = std::move(nodes_)}, leaves).nodes;
  }

  void enter(OpenLeaf leaf) {
    if (const std::optional<StopReason> reason = refusal(leaf)) {
      ++refusals_[static_cast<std::size_t>(*reason)];
      return;
    }
    const float gain = static_cast<float>(leaf.rss - leaf.best.rss);
    queue_.push({gain, leaf.node, leaves_.size()});
    leaves_.emplace_back(std::move(leaf));
  }

  void split(std::size_t position) {
    const OpenLeaf leaf = std::move(*leaves_[position]);
    leaves_[position].reset();
    std::array<OpenLeaf, 2> children = divide(leaf);
    const Node parent = nodes_[static_cast<std::size_t>(leaf.node)];
    for (OpenLeaf& child : children) {
      child.node = static_cast<int>(nodes_.size());
      nodes_.emplace_back();
    }
    parallel_for(2, problem_.max_threads, [&](std::ptrdiff_t side) {
      OpenLeaf& child = children[static_cast<std::size_t>(side)];
      std::vector<int> positions;  // of the child's rows among the parent's
      for (std::size_t i = 0, k = 0; k < child.rows.size(); ++i) {
        if (leaf.rows[i] == child.rows[k]) {
          positions.push_back(static_cast<int>(i));
          ++k;
        }
      }
      const NodeFit fit = fit_leaf(child, parent, leaf.residuals(positions, Eigen::all));
      find_split(child, fit);
    });
    Node& node = nodes_[static_cast<std::size_t>(leaf.node)];
    node.left = children[0].node;
    node.right = children[1].node;
    node.split_input = options_.split_inputs[static_cast<std::size_t>(leaf.best.input)];
    node.threshold = place_threshold(leaf);
    tree_rss_.push_back(tree_rss_.back() - (leaf.rss - children[0].rss - children[1].rss));
    for (OpenLeaf& child : children) {
      enter(std::move(child));
    }
  }

  /// Rows and orders of the two children; all orders stay sorted.
  std::array<OpenLeaf, 2> divide(const OpenLeaf& leaf) {
    const Rows& order = leaf.orders[static_cast<std::size_t>(leaf.best.input)];
    for (std::size_t k = 0; k < order.size(); ++k) {
      local_row_[static_cast<std::size_t>(order[k])] = static_cast<std::ptrdiff_t>(k) < leaf.best.left ? 0 : 1;
    }
    const auto deal = [&](const Rows& from, Rows& left, Rows& right) {
      for (const int row : from) {
        (local_row_[static_cast<std::size_t>(row)] == 0 ? left : right).push_back(row);
      }
    };
    std::array<OpenLeaf, 2> children;
    deal(leaf.rows, children[0].rows, children[1].rows);
    for (OpenLeaf& child : children) {
      child.orders.resize(leaf.orders.size());
    }
    for (std::size_t j = 0; j < leaf.orders.size(); ++j) {
      deal(leaf.orders[j], children[0].orders[j], children[1].orders[j]);
    }
    return children;
  }

  /// A threshold in the gap of the leaf's split, low <= threshold < high.
  double place_threshold(const OpenLeaf& leaf) const {
    const Rows& order = leaf.orders[static_cast<std::size_t>(leaf.best.input)];
    const auto value_at = [&](std::ptrdiff_t k) {
      return problem_.split_values(order[static_cast<std::size_t>(k)], leaf.best.input);
    };
    const double low = value_at(leaf.best.left - 1);
    const double high = value_at(leaf.best.left);
    double threshold = low + 0.5 * (high - low);
    if (options_.threshold == ThresholdPlacement::closest) {
      // The regression of the child models' difference on the split input over the node's rows says how far apart they
      // are, on average, on the plane x_j = t: a + b (t - low). Its square is smallest at t = low - a / b, or at the
      // end of the gap nearest to that.
      const Node& node = nodes_[static_cast<std::size_t>(leaf.node)];
      const Node& left = nodes_[static_cast<std::size_t>(node.left)];
      const Node& right = nodes_[static_cast<std::size_t>(node.right)];
      const Eigen::MatrixXd apart =
          (problem_.deviations(leaf.rows, Eigen::all) * (right.slope - left.slope).transpose()).rowwise() +
          Eigen::RowVectorXd((right.value - left.value).transpose());
      const Eigen::VectorXd values = problem_.split_values(leaf.rows, leaf.best.input);
      const double mean = values.mean();
      const Eigen::VectorXd centred = values.array() - mean;
      const Eigen::VectorXd b = apart.transpose() * centred / centred.squaredNorm();
      const Eigen::VectorXd a = apart.colwise().mean().transpose() + b * (low - mean);
      const double curvature = weights_.dot(b.cwiseAbs2());
      if (curvature > 0.0) {
        threshold = low - weights_.dot(a.cwiseProduct(b)) / curvature;
      }
    }
    return std::min(std::max(threshold, low), std::nextafter(high, low));
  }

  const GrowthProblem& problem_;
  const GrowthOptions& options_;
  Eigen::MatrixXd scaled_outputs_;
  Eigen::VectorXd output_mean_;
  Eigen::VectorXd output_scale_;
  Eigen::VectorXd weights_;  // of the scaled outputs' sums of squares: 1 / their total
  Eigen::VectorXd
      rounding_;  // root mean square residual, in scaled outputs, that is rounding of the outputs themselves
  std::vector<Node> nodes_;
  std::vector<std::optional<OpenLeaf>> leaves_;
  std::priority_queue<Priority> queue_;
  std::array<std::ptrdiff_t, 8> refusals_{};  // leaves that stay, by StopReason
  std::vector<int> local_row_;                // scratch, one slot per row; open leaves share no row
  std::vector<double> tree_rss_;              // weighted, with 1, 2, ... leaves
};

}  // namespace

GrownPartition grow(const GrowthProblem& problem) { return Grower(problem).run(); }

}  // namespace llmt
