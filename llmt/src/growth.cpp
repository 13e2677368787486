#include "growth.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <queue>

#include "evaluator.hpp"
#include "f_distribution.hpp"
#include "node_fit.hpp"
#include "parallel.hpp"
#include "pruning.hpp"
#include "split_search.hpp"

namespace llmt {
namespace {

using Rows = std::vector<int>;

/// The learned share of the left child in rows without a value starts from the share of the others, which counts as
/// this many rows.
constexpr double prior_rows = 10.0;

/// A node that may still be split.
struct OpenLeaf {
  int node = 0;
  Rows rows;                  // ascending
  Eigen::VectorXd weights;    // of the rows here
  std::vector<Rows> orders;   // positions in `rows` sorted by each split input that is a number, ties by row
  Eigen::MatrixXd residuals;  // of the node's local model, one row per entry of `rows`
  double rss = 0.0;           // weighted
  SplitCandidate best;        // input: position among the split inputs
};

/// Where a row of a node goes.
enum class Side : signed char { left, right, both };

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
      : problem_(problem), options_(problem.options), missing_(problem.deviations.hasNaN()) {
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
      node.missing_left = std::clamp(node.missing_left, 0.0, 1.0);
    }
    return {std::move(nodes_), stop};
  }

 private:
  /// Outputs about their mean, divided by a power of two near their largest deviation: a target of scale 1e-6 and one
  /// with offset 1e8 look alike from here on, and dividing by a power of two rounds nothing.
  void scale_outputs() {
    const Eigen::MatrixXd& outputs = problem_.outputs;
    output_mean_ = outputs.transpose() * problem_.weights / problem_.weights.sum();
    scaled_outputs_ = outputs.rowwise() - Eigen::RowVectorXd(output_mean_.transpose());
    output_scale_.resize(outputs.cols());
    weights_.resize(outputs.cols());
    rounding_.resize(outputs.cols());
    for (std::ptrdiff_t o = 0; o < outputs.cols(); ++o) {
      const double largest = scaled_outputs_.col(o).cwiseAbs().maxCoeff();
      output_scale_(o) = largest > 0.0 ? std::exp2(std::ilogb(largest)) : 1.0;
      scaled_outputs_.col(o) /= output_scale_(o);
      const double sum_of_squares = problem_.weights.dot(scaled_outputs_.col(o).cwiseAbs2());
      weights_(o) = sum_of_squares > 0.0 ? 1.0 / sum_of_squares : 1.0;
      rounding_(o) =
          8.0 * std::numeric_limits<double>::epsilon() * outputs.col(o).cwiseAbs().maxCoeff() / output_scale_(o);
    }
  }

  void open_root() {
    OpenLeaf root;
    root.rows.resize(static_cast<std::size_t>(problem_.outputs.rows()));
    std::iota(root.rows.begin(), root.rows.end(), 0);
    root.weights = problem_.weights;
    root.orders.resize(static_cast<std::size_t>(problem_.split_values.cols()));
    parallel_for(std::ssize(root.orders), problem_.max_threads, [&](std::ptrdiff_t j) {
      if (num_levels(j) > 0) {
        return;
      }
      const Eigen::MatrixXd& values = problem_.split_values;
      Rows& order = root.orders[static_cast<std::size_t>(j)];
      std::copy_if(root.rows.begin(), root.rows.end(), std::back_inserter(order),
                   [&](int row) { return !std::isnan(values(row, j)); });
      std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return values(a, j) < values(b, j); });
    });
    Node parentless;
    parentless.value = Eigen::VectorXd::Zero(problem_.outputs.cols());
    parentless.slope = Eigen::MatrixXd::Zero(problem_.outputs.cols(), problem_.deviations.cols());
    parentless.mean = Eigen::VectorXd::Zero(problem_.deviations.cols());
    nodes_.resize(1);
    NodeFit fit = fit_leaf(root, parentless, scaled_outputs_);
    tree_rss_ = {root.rss};
    find_split(root, std::move(fit));
    enter(std::move(root));
  }

  int num_levels(std::ptrdiff_t split_input) const {
    return problem_.num_levels[static_cast<std::size_t>(split_input)];
  }

  /// Fits the local model of `leaf` as a correction of its parent's, whose residuals on the leaf's rows are given.
  NodeFit fit_leaf(OpenLeaf& leaf, const Node& parent, const Eigen::MatrixXd& parent_residuals) {
    const RowMajor deviations = problem_.deviations(leaf.rows, Eigen::all);
    NodeFit fit = missing_ ? fit_node(deviations, about_own_mean(deviations, parent, parent_residuals, leaf.weights),
                                      leaf.weights)
                           : fit_node(deviations, parent_residuals, leaf.weights);
    Node& node = nodes_[static_cast<std::size_t>(leaf.node)];
    node.samples = std::ssize(leaf.rows);
    node.rank = fit.rank;
    node.rss = fit.rss;
    node.value = parent.value + fit.centre_change;
    node.slope = parent.slope + fit.slope_change;
    node.mean = fit.mean;
    node.low = fit.low;
    node.high = fit.high;
    leaf.residuals = fit.residuals();
    leaf.rss = weights_.dot(fit.rss);
    return fit;
  }

  /// Residuals of the parent's local model with missing values at the mean of these rows instead of the parent's.
  static Eigen::MatrixXd about_own_mean(const RowMajor& deviations, const Node& parent, Eigen::MatrixXd residuals,
                                        const Eigen::VectorXd& weights) {
    for (std::ptrdiff_t k = 0; k < deviations.cols(); ++k) {
      double sum = 0.0;
      double present = 0.0;
      for (std::ptrdiff_t i = 0; i < deviations.rows(); ++i) {
        if (!std::isnan(deviations(i, k))) {
          sum += weights(i) * deviations(i, k);
          present += weights(i);
        }
      }
      const double mean = present > 0.0 ? sum / present : 0.0;
      for (std::ptrdiff_t i = 0; i < deviations.rows(); ++i) {
        if (std::isnan(deviations(i, k))) {
          residuals.row(i) += parent.slope.col(k).transpose() * (parent.mean(k) - mean);
        }
      }
    }
    return residuals;
  }

  /// Level of each row of the leaf in a categorical split input, -1 where it is missing.
  std::vector<int> levels_of(const OpenLeaf& leaf, std::ptrdiff_t split_input) const {
    std::vector<int> levels;
    for (const int row : leaf.rows) {
      const double value = problem_.split_values(row, split_input);
      levels.push_back(std::isnan(value) ? -1 : static_cast<int>(value));
    }
    return levels;
  }

  /// Searches all split inputs; leaves in leaf.best the best split, acceptable or not.
  void find_split(OpenLeaf& leaf, NodeFit fit) {
    if (std::ssize(leaf.rows) < 2 * options_.min_leaf_samples) {
      return;
    }
    const SearchNode node{std::move(fit.features), weights_, leaf.rss};
    const std::size_t inputs = leaf.orders.size();
    std::vector<std::optional<InputSearch>> searches(inputs);
    std::vector<SplitCandidate> found(inputs);
    parallel_for(std::ssize(found), problem_.max_threads, [&](std::ptrdiff_t j) {
      const std::size_t slot = static_cast<std::size_t>(j);
      if (num_levels(j) > 0) {
        found[slot] = search_levels(node, levels_of(leaf, j), num_levels(j), options_.min_leaf_samples);
        return;
      }
      const Rows& order = leaf.orders[slot];
      std::vector<double> values(order.size());
      for (std::size_t k = 0; k < order.size(); ++k) {
        values[k] = problem_.split_values(leaf.rows[static_cast<std::size_t>(order[k])], j);
      }
      searches[slot].emplace(node, std::move(values), order, options_.min_leaf_samples);
      searches[slot]->search_edges();
    });
    // What one input has found spares the others work, in a way that does not depend on who was first.
    double limit = std::numeric_limits<double>::infinity();
    for (std::size_t j = 0; j < inputs; ++j) {
      limit = std::min(limit, searches[j] ? searches[j]->smallest() : limit);
    }
    parallel_for(std::ssize(found), problem_.max_threads, [&](std::ptrdiff_t j) {
      const std::size_t slot = static_cast<std::size_t>(j);
      if (searches[slot]) {
        searches[slot]->refine(limit);
        found[slot] = searches[slot]->best();
        if (leaf.orders[slot].size() < leaf.rows.size()) {
          consider_missing(node, leaf, j, found[slot]);
        }
        searches[slot].reset();
      }
    });
    double smallest = std::numeric_limits<double>::infinity();
    std::ptrdiff_t tested = 0;
    for (const SplitCandidate& candidate : found) {
      tested += candidate.tested;
      smallest = candidate.input >= 0 ? std::min(smallest, candidate.rss) : smallest;
    }
    for (std::size_t j = 0; j < inputs && leaf.best.input < 0; ++j) {
      if (found[j].input >= 0 && found[j].rss <= smallest + tie_tolerance * leaf.rss) {
        leaf.best = found[j];
        leaf.best.input = static_cast<int>(j);
      }
    }
    leaf.best.tested = tested;
  }

  /// Takes the split into rows with and without a value if it is better: that a value is missing can say something.
  void consider_missing(const SearchNode& node, const OpenLeaf& leaf, std::ptrdiff_t j, SplitCandidate& best) const {
    std::vector<int> is_missing;
    for (const int row : leaf.rows) {
      is_missing.push_back(std::isnan(problem_.split_values(row, j)) ? 1 : 0);
    }
    SplitCandidate candidate = search_levels(node, is_missing, 2, options_.min_leaf_samples);
    const std::ptrdiff_t tested = best.tested + candidate.tested;
    if (candidate.input >= 0 && (best.input < 0 || candidate.rss < best.rss - tie_tolerance * leaf.rss)) {
      best = std::move(candidate);
      best.level_side.clear();
      best.by_missing = true;
    }
    best.tested = tested;
  }

  /// Why the leaf's best split is not to be made, if so.
  std::optional<StopReason> refusal(const OpenLeaf& leaf) const {
    const Node& node = nodes_[static_cast<std::size_t>(leaf.node)];
    const double samples = leaf.weights.sum();
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
      const double to_fraction = (problem_.weights.sum() - 1.0) / outputs;
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
    const Node parent = nodes_[static_cast<std::size_t>(leaf.node)];
    const std::vector<Side> sides = sides_of(leaf);
    const double missing_left = leaf.best.by_missing ? 0.0 : learn_missing_left(leaf, parent, sides);
    std::array<OpenLeaf, 2> children;
    std::array<Rows, 2> positions;  // of the children's rows among the leaf's
    divide(leaf, sides, missing_left, children, positions);
    for (OpenLeaf& child : children) {
      child.node = static_cast<int>(nodes_.size());
      nodes_.emplace_back();
    }
    parallel_for(2, problem_.max_threads, [&](std::ptrdiff_t side) {
      OpenLeaf& child = children[static_cast<std::size_t>(side)];
      NodeFit fit = fit_leaf(child, parent, leaf.residuals(positions[static_cast<std::size_t>(side)], Eigen::all));
      find_split(child, std::move(fit));
    });
    Node& node = nodes_[static_cast<std::size_t>(leaf.node)];
    node.left = children[0].node;
    node.right = children[1].node;
    node.split_input = options_.split_inputs[static_cast<std::size_t>(leaf.best.input)];
    node.level_side = leaf.best.level_side;
    node.threshold = leaf.best.by_missing      ? std::numeric_limits<double>::max()
                     : node.level_side.empty() ? place_threshold(leaf)
                                               : 0.0;
    node.missing_left = missing_left;
    tree_rss_.push_back(tree_rss_.back() - (leaf.rss - children[0].rss - children[1].rss));
    for (OpenLeaf& child : children) {
      enter(std::move(child));
    }
  }

  /// Where the best split of a leaf sends its rows.
  std::vector<Side> sides_of(const OpenLeaf& leaf) const {
    std::vector<Side> sides(leaf.rows.size(), Side::both);
    if (leaf.best.by_missing) {
      for (std::size_t k = 0; k < sides.size(); ++k) {
        sides[k] = std::isnan(problem_.split_values(leaf.rows[k], leaf.best.input)) ? Side::right : Side::left;
      }
      return sides;
    }
    if (num_levels(leaf.best.input) > 0) {
      const std::vector<int> levels = levels_of(leaf, leaf.best.input);
      for (std::size_t k = 0; k < sides.size(); ++k) {
        if (levels[k] >= 0) {
          sides[k] = leaf.best.level_side[static_cast<std::size_t>(levels[k])] < 0 ? Side::left : Side::right;
        }
      }
      return sides;
    }
    const Rows& order = leaf.orders[static_cast<std::size_t>(leaf.best.input)];
    for (std::size_t k = 0; k < order.size(); ++k) {
      sides[static_cast<std::size_t>(order[k])] =
          static_cast<std::ptrdiff_t>(k) < leaf.best.left ? Side::left : Side::right;
    }
    return sides;
  }

  /// Share of the left child in rows that have no value for the split: the one that minimises their squared error
  /// under the local models of the rows that have one, drawn towards the share of those; in [0, 1].
  double learn_missing_left(const OpenLeaf& leaf, const Node& parent, const std::vector<Side>& sides) const {
    std::array<Rows, 3> positions;
    std::array<double, 3> weight{};
    for (std::size_t k = 0; k < sides.size(); ++k) {
      positions[static_cast<std::size_t>(sides[k])].push_back(static_cast<int>(k));
      weight[static_cast<std::size_t>(sides[k])] += leaf.weights(static_cast<std::ptrdiff_t>(k));
    }
    const double known = weight[0] / (weight[0] + weight[1]);
    const Rows& missing = positions[2];
    if (missing.empty()) {
      return known;
    }
    const RowMajor deviations = problem_.deviations(leaf.rows, Eigen::all);
    const RowMajor queries = deviations(missing, Eigen::all);
    std::array<Eigen::MatrixXd, 2> change;  // child's prediction minus the leaf's, rows x outputs
    for (std::size_t side = 0; side < 2; ++side) {
      const RowMajor of_child = deviations(positions[side], Eigen::all);
      const Eigen::VectorXd weights = leaf.weights(positions[side]);
      const Eigen::MatrixXd residuals =
          about_own_mean(of_child, parent, leaf.residuals(positions[side], Eigen::all), weights);
      const NodeFit fit = fit_node(of_child, residuals, weights);
      change[side] = fit.centre_change.transpose().replicate(queries.rows(), 1);
      for (std::ptrdiff_t i = 0; i < queries.rows(); ++i) {
        for (std::ptrdiff_t k = 0; k < queries.cols(); ++k) {
          if (std::isnan(queries(i, k))) {
            change[side].row(i) +=
                (fit.slope_change.col(k) * fit.mean(k) + parent.slope.col(k) * (fit.mean(k) - parent.mean(k)))
                    .transpose();
          } else {
            change[side].row(i) += fit.slope_change.col(k).transpose() * queries(i, k);
          }
        }
      }
    }
    const Eigen::MatrixXd apart = change[0] - change[1];
    const Eigen::MatrixXd error = leaf.residuals(missing, Eigen::all) - change[1];
    const Eigen::VectorXd weights = leaf.weights(missing);
    const double squares = weights.dot(apart.cwiseAbs2() * weights_);
    const double product = weights.dot(apart.cwiseProduct(error) * weights_);
    const double prior = prior_rows * squares / weights.sum();
    return squares > 0.0 ? std::clamp((product + prior * known) / (squares + prior), 0.0, 1.0) : known;
  }

  /// Rows, weights and orders of the two children; all orders stay sorted.
  static void divide(const OpenLeaf& leaf, const std::vector<Side>& sides, double missing_left,
                     std::array<OpenLeaf, 2>& children, std::array<Rows, 2>& positions) {
    const std::array<double, 2> shares = {missing_left, 1.0 - missing_left};
    for (std::size_t side = 0; side < 2; ++side) {
      OpenLeaf& child = children[side];
      const Side own = side == 0 ? Side::left : Side::right;
      std::vector<int> position_in_child(leaf.rows.size(), -1);
      std::vector<double> weights;
      for (std::size_t k = 0; k < sides.size(); ++k) {
        const double share = sides[k] == own ? 1.0 : sides[k] == Side::both ? shares[side] : 0.0;
        // A row that may as well belong to the other side would teach the child wrong.
        if (share >= clear_share) {
          position_in_child[k] = static_cast<int>(child.rows.size());
          child.rows.push_back(leaf.rows[k]);
          positions[side].push_back(static_cast<int>(k));
          weights.push_back(share * leaf.weights(static_cast<std::ptrdiff_t>(k)));
        }
      }
      child.weights = Eigen::Map<const Eigen::VectorXd>(weights.data(), std::ssize(weights));
      child.orders.resize(leaf.orders.size());
      for (std::size_t j = 0; j < leaf.orders.size(); ++j) {
        for (const int k : leaf.orders[j]) {
          if (const int position = position_in_child[static_cast<std::size_t>(k)]; position >= 0) {
            child.orders[j].push_back(position);
          }
        }
      }
    }
  }

  /// A threshold in the gap of the leaf's split, low <= threshold < high.
  double place_threshold(const OpenLeaf& leaf) const {
    const Rows& order = leaf.orders[static_cast<std::size_t>(leaf.best.input)];
    Rows rows;  // with a value, in the order of it
    for (const int k : order) {
      rows.push_back(leaf.rows[static_cast<std::size_t>(k)]);
    }
    const Eigen::VectorXd values = problem_.split_values(rows, leaf.best.input);
    const double low = values(leaf.best.left - 1);
    const double high = values(leaf.best.left);
    double threshold = low + 0.5 * (high - low);
    if (options_.threshold == ThresholdPlacement::closest) {
      // The regression of the child models' difference on the split input over the node's rows says how far apart they
      // are, on average, on the plane x_j = t: a + b (t - low). They meet at t = low - a / b. If that is not in the gap
      // they do not meet here: a jump, and the middle keeps away from the rows of both sides.
      const Node& node = nodes_[static_cast<std::size_t>(leaf.node)];
      const Node& left = nodes_[static_cast<std::size_t>(node.left)];
      const Node& right = nodes_[static_cast<std::size_t>(node.right)];
      const Eigen::VectorXd weights = leaf.weights(order);
      Eigen::MatrixXd deviations = problem_.deviations(rows, Eigen::all);
      deviations = deviations.array().isNaN().select(node.mean.transpose().replicate(deviations.rows(), 1), deviations);
      const Eigen::MatrixXd apart = (deviations * (right.slope - left.slope).transpose()).rowwise() +
                                    Eigen::RowVectorXd((right.value - left.value).transpose());
      const double mean = weights.dot(values) / weights.sum();
      const Eigen::VectorXd centred = values.array() - mean;
      const Eigen::VectorXd weighted = centred.cwiseProduct(weights);
      const Eigen::VectorXd b = apart.transpose() * weighted / weighted.dot(centred);
      const Eigen::VectorXd a = apart.transpose() * weights / weights.sum() + b * (low - mean);
      const double curvature = weights_.dot(b.cwiseAbs2());
      const double meeting = curvature > 0.0 ? low - weights_.dot(a.cwiseProduct(b)) / curvature : low;
      if (meeting > low && meeting < high) {
        threshold = meeting;
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
  bool missing_;  // whether a regressor has missing values
  std::vector<Node> nodes_;
  std::vector<std::optional<OpenLeaf>> leaves_;
  std::priority_queue<Priority> queue_;
  std::array<std::ptrdiff_t, 9> refusals_{};  // leaves that stay, by StopReason
  std::vector<double> tree_rss_;              // weighted, with 1, 2, ... leaves
};

}  // namespace

GrownPartition grow(const GrowthProblem& problem) { return Grower(problem).run(); }

}  // namespace llmt
