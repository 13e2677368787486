#include "m5_growth.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <queue>

#include "leaf_validities.hpp"
#include "m5_model.hpp"
#include "m5_split.hpp"
#include "node_fit.hpp"

namespace llmt {
namespace {

using Rows = std::vector<int>;

/// A node is not split if its outputs deviate by less than this part of those of all rows (Quinlan 1992).
constexpr double least_deviation = 0.05;

/// Nor does a subtree stay if one model leaves less than this part of it: what is left is rounding.
constexpr double negligible_error = 1e-5;

/// Rows that the model of a node counts as when that of its child is drawn towards it (Quinlan 1992).
constexpr double smoothing_rows = 15.0;

/// The learned share of the left child in rows without a value starts from the share of the others, which counts as
/// this many rows.
constexpr double prior_rows = 10.0;

/// The model of a node as it stands, before smoothing, in scaled outputs.
struct RawModel {
  Eigen::VectorXd value;
  Eigen::MatrixXd slope;         // outputs x regressors
  Eigen::VectorXd coefficients;  // number of them, per output; of the subtree where it is not pruned
};

struct Branch {
  int parent = -1;
  int left = -1;
  int right = -1;
  std::ptrdiff_t begin = 0;  // its rows among all: those of the left child, of the right one, of neither
  std::ptrdiff_t end = 0;
  double weight = 0.0;
  DeviationSplit split;
  double missing_left = 0.5;
  std::vector<std::pair<int, double>> shared;  // rows that a child has in part, and their weights here
  std::vector<bool> tested;                    // split inputs at or below
  RawModel model;
};

class M5 {
 public:
  explicit M5(const GrowthProblem& problem) : data_(problem), weights_(data_.weights) {
    const std::ptrdiff_t regressors = std::ssize(data_.training.regressors);
    deviations_.resize(data_.training.count(), regressors);
    for (std::ptrdiff_t index = 0; index < num_chunks(data_.training); ++index) {
      const Chunk chunk = fetch(data_.training, index, {});
      deviations_.middleRows(index * chunk_rows, chunk.count()) = chunk.deviations;
    }
    unit_ = (data_.output_weights * data_.weights.sum()).cwiseSqrt();
  }

  GrownPartition run() {
    grow();
    const std::ptrdiff_t grown = std::ssize(branches_);
    residuals_.resize(data_.training.count(), data_.outputs.cols());
    // Children stand after their parents: backwards is from the leaves up.
    for (std::ptrdiff_t i = grown; i-- > 0;) {
      prune(static_cast<std::size_t>(i));
    }
    return finish();
  }

 private:
  std::span<int> rows_of(const Branch& branch) {
    return std::span(rows_).subspan(static_cast<std::size_t>(branch.begin),
                                    static_cast<std::size_t>(branch.end - branch.begin));
  }

  /// Splits every node as far as it goes, and deals the rows.
  void grow() {
    rows_.resize(static_cast<std::size_t>(data_.training.count()));
    std::iota(rows_.begin(), rows_.end(), 0);
    std::vector<std::pair<int, std::vector<Rows>>> open;  // nodes and the orders of their rows
    std::vector<Rows> orders(static_cast<std::size_t>(data_.split_inputs()));
    for (std::size_t j = 0; j < orders.size(); ++j) {
      const std::ptrdiff_t input = static_cast<std::ptrdiff_t>(j);
      if (data_.num_levels[j] == 0) {
        std::copy_if(rows_.begin(), rows_.end(), std::back_inserter(orders[j]),
                     [&](int row) { return !std::isnan(data_.split_value(row, input)); });
        std::stable_sort(orders[j].begin(), orders[j].end(),
                         [&](int a, int b) { return data_.split_value(a, input) < data_.split_value(b, input); });
      }
    }
    branches_.resize(1);
    branches_[0].end = std::ssize(rows_);
    open.emplace_back(0, std::move(orders));
    while (!open.empty()) {
      auto [index, of_node] = std::move(open.back());
      open.pop_back();
      std::array<std::vector<Rows>, 2> of_children;
      if (split(static_cast<std::size_t>(index), of_node, of_children)) {
        const Branch& branch = branches_[static_cast<std::size_t>(index)];
        open.emplace_back(branch.left, std::move(of_children[0]));
        open.emplace_back(branch.right, std::move(of_children[1]));
      }
    }
  }

  /// False if the node stays a leaf. Sets the weights of its rows.
  bool split(std::size_t index, const std::vector<Rows>& orders, std::array<std::vector<Rows>, 2>& of_children) {
    Branch& branch = branches_[index];
    const std::span<int> rows = rows_of(branch);
    const Rows own(rows.begin(), rows.end());
    const DeviationNode node{own, orders, weights_};
    branch.tested.assign(static_cast<std::size_t>(data_.split_inputs()), false);
    for (const int row : own) {
      branch.weight += weights_(row);
    }
    const double all = static_cast<double>(data_.outputs.cols());
    if (relative_deviation(data_, node) < least_deviation * all) {
      return false;
    }
    branch.split = largest_decrease(data_, node);
    if (branch.split.input < 0) {
      return false;
    }
    std::array<Rows, 3> sides;  // left, right, neither
    deal(branch, own, sides);
    branch.tested[static_cast<std::size_t>(branch.split.input)] = true;
    std::ptrdiff_t at = branch.begin;
    branch.left = static_cast<int>(branches_.size());
    branch.right = branch.left + 1;
    std::array<Branch, 2> children;
    for (std::size_t side = 0; side < 3; ++side) {
      const std::ptrdiff_t begin = at;
      at += std::ssize(sides[side]);
      std::copy(sides[side].begin(), sides[side].end(), rows_.begin() + begin);
      if (side < 2) {
        children[side].parent = static_cast<int>(index);
        children[side].begin = begin;
        children[side].end = at;
      }
    }
    divide_orders(sides, orders, of_children);
    branches_.push_back(std::move(children[0]));
    branches_.push_back(std::move(children[1]));
    return true;
  }

  void divide_orders(const std::array<Rows, 3>& sides, const std::vector<Rows>& orders,
                     std::array<std::vector<Rows>, 2>& of_children) {
    side_.resize(static_cast<std::size_t>(data_.training.count()));
    for (std::size_t side = 0; side < 3; ++side) {
      for (const int row : sides[side]) {
        side_[static_cast<std::size_t>(row)] = static_cast<signed char>(side);
      }
    }
    for (std::size_t side = 0; side < 2; ++side) {
      of_children[side].resize(orders.size());
      for (std::size_t j = 0; j < orders.size(); ++j) {
        std::copy_if(orders[j].begin(), orders[j].end(), std::back_inserter(of_children[side][j]),
                     [&](int row) { return side_[static_cast<std::size_t>(row)] == static_cast<signed char>(side); });
      }
    }
  }

  /// The rows of either child. Those without a value go to the child that has nearly all of them, if one has.
  void deal(Branch& branch, const Rows& rows, std::array<Rows, 3>& sides) {
    const DeviationSplit& split = branch.split;
    std::array<double, 2> weight{};
    for (const int row : rows) {
      const double value = data_.split_value(row, split.input);
      const std::size_t side = std::isnan(value)  ? (split.by_missing ? 1 : 2)
                               : split.by_missing ? 0
                               : !split.level_side.empty()
                                   ? (split.level_side[static_cast<std::size_t>(value)] < 0 ? 0 : 1)
                               : value <= split.threshold ? 0
                                                          : 1;
      sides[side].push_back(row);
      if (side < 2) {
        weight[side] += weights_(row);
      }
    }
    branch.missing_left = split.by_missing ? 0.0 : learn_missing_left(sides, weight[0] / (weight[0] + weight[1]));
    for (const std::size_t side : {0U, 1U}) {
      const double share = side == 0 ? branch.missing_left : 1.0 - branch.missing_left;
      if (share >= clear_share && !sides[2].empty()) {
        for (const int row : sides[2]) {
          branch.shared.emplace_back(row, weights_(row));
          weights_(row) *= share;
          sides[side].push_back(row);
        }
        sides[2].clear();
        std::sort(sides[side].begin(), sides[side].end());
      }
    }
  }

  /// Share of the left child in rows without a value that minimises their squared error under the means of the rows
  /// that have one, drawn towards the share `known` of those; in [0, 1].
  double learn_missing_left(const std::array<Rows, 3>& sides, double known) const {
    std::array<Eigen::VectorXd, 2> mean;
    for (std::size_t side = 0; side < 2; ++side) {
      const Eigen::VectorXd weights = weights_(sides[side]);
      mean[side] = data_.outputs(sides[side], Eigen::all).transpose() * weights / weights.sum();
    }
    const Eigen::VectorXd apart = mean[0] - mean[1];
    double squares = 0.0;
    double product = 0.0;
    double weight = 0.0;
    for (const int row : sides[2]) {
      const Eigen::VectorXd error = data_.outputs.row(row).transpose() - mean[1];
      squares += weights_(row) * data_.output_weights.dot(apart.cwiseAbs2());
      product += weights_(row) * data_.output_weights.dot(apart.cwiseProduct(error));
      weight += weights_(row);
    }
    if (!(squares > 0.0)) {
      return known;
    }
    const double prior = prior_rows * squares / weight;
    return std::clamp((product + prior * known) / (squares + prior), 0.0, 1.0);
  }

  /// Regressors of the inputs that are tested at or below a node.
  std::vector<int> regressors_of(const Branch& branch) const {
    std::vector<int> result;
    const std::vector<Regressor>& regressors = data_.training.regressors;
    for (std::size_t k = 0; k < regressors.size(); ++k) {
      for (std::size_t j = 0; j < branch.tested.size(); ++j) {
        if (branch.tested[j] && data_.problem.options.split_inputs[j] == regressors[k].input) {
          result.push_back(static_cast<int>(k));
        }
      }
    }
    return result;
  }

  /// Regressors of some rows, missing values at the means of the rows.
  RowMajor regressors_at(const Rows& rows, const std::vector<int>& columns, const Eigen::VectorXd& weights) const {
    RowMajor x = deviations_(rows, columns);
    for (std::ptrdiff_t k = 0; data_.training.has_missing && k < x.cols(); ++k) {
      double sum = 0.0;
      double present = 0.0;
      for (std::ptrdiff_t i = 0; i < x.rows(); ++i) {
        sum += std::isnan(x(i, k)) ? 0.0 : weights(i) * x(i, k);
        present += std::isnan(x(i, k)) ? 0.0 : weights(i);
      }
      const double mean = present > 0.0 ? sum / present : 0.0;
      x.col(k) = x.col(k).array().isNaN().select(mean, x.col(k));
    }
    return x;
  }

  /// Fits the node's model and lets it take the place of the subtree, the children of which are done, unless that has
  /// the smaller adjusted error.
  void prune(std::size_t index) {
    Branch& branch = branches_[index];
    for (const auto& [row, weight] : branch.shared) {
      weights_(row) = weight;
    }
    const std::span<int> own = rows_of(branch);
    const Rows rows(own.begin(), own.end());
    const Eigen::VectorXd weights = weights_(rows);
    const std::ptrdiff_t outputs = data_.outputs.cols();
    const bool is_leaf = branch.left < 0;
    if (!is_leaf) {
      for (std::size_t j = 0; j < branch.tested.size(); ++j) {
        branch.tested[j] = branch.tested[j] || branches_[static_cast<std::size_t>(branch.left)].tested[j] ||
                           branches_[static_cast<std::size_t>(branch.right)].tested[j];
      }
    }
    const std::vector<int> columns = regressors_of(branch);
    const RowMajor x = regressors_at(rows, columns, weights);
    RawModel& model = branch.model;
    model.value.resize(outputs);
    model.slope = Eigen::MatrixXd::Zero(outputs, deviations_.cols());
    model.coefficients.resize(outputs);
    Eigen::MatrixXd residuals(std::ssize(rows), outputs);
    double of_model = 0.0;
    double of_subtree = 0.0;
    Eigen::VectorXd below = Eigen::VectorXd::Zero(outputs);
    for (std::ptrdiff_t o = 0; o < outputs; ++o) {
      FewInputsModel fit = fit_few_inputs(x, data_.outputs.col(o)(rows), weights);
      model.value(o) = fit.value;
      model.slope.row(o)(columns) = fit.slope.transpose();
      model.coefficients(o) = fit.coefficients;
      residuals.col(o) = fit.residuals;
      of_model += unit_(o) * adjusted_error(fit.rms, branch.weight, fit.coefficients);
      if (!is_leaf) {
        below(o) = branches_[static_cast<std::size_t>(branch.left)].model.coefficients(o) +
                   branches_[static_cast<std::size_t>(branch.right)].model.coefficients(o) + 1.0;
        // Rows of neither child count alike on both sides.
        const std::ptrdiff_t neither = branches_[static_cast<std::size_t>(branch.right)].end - branch.begin;
        for (std::ptrdiff_t k = neither; k < std::ssize(rows); ++k) {
          residuals_(branch.begin + k, o) = fit.residuals(k);
        }
        const Eigen::VectorXd left_over = residuals_.col(o).segment(branch.begin, std::ssize(rows));
        of_subtree += unit_(o) * adjusted_error(std::sqrt(weights.dot(left_over.cwiseAbs2()) / branch.weight),
                                                branch.weight, below(o));
      }
    }
    if (is_leaf || of_model <= of_subtree || of_model < negligible_error * static_cast<double>(outputs)) {
      pruned_ = pruned_ || !is_leaf;
      branch.left = branch.right = -1;
      residuals_.middleRows(branch.begin, std::ssize(rows)) = residuals;
    } else {
      model.coefficients = below;
    }
  }

  /// The smoothed model of a node: from below, p' = (n p + 15 q) / (n + 15) with the model q of each ancestor and the
  /// weight n of its child on the path.
  RawModel smoothed(int index) const {
    const Branch* child = &branches_[static_cast<std::size_t>(index)];
    RawModel result = child->model;
    for (int at = child->parent; at >= 0; at = child->parent) {
      const Branch& ancestor = branches_[static_cast<std::size_t>(at)];
      const double share = child->weight / (child->weight + smoothing_rows);
      result.value = share * result.value + (1.0 - share) * ancestor.model.value;
      result.slope = share * result.slope + (1.0 - share) * ancestor.model.slope;
      child = &ancestor;
    }
    return result;
  }

  Node make_node(int index) {
    const Branch& branch = branches_[static_cast<std::size_t>(index)];
    const std::span<int> own = rows_of(branch);
    const Rows rows(own.begin(), own.end());
    const Eigen::VectorXd weights = data_.weights(rows);
    const RowMajor x = deviations_(rows, Eigen::all);
    const Eigen::MatrixXd y = data_.outputs(rows, Eigen::all);
    const NodeFit fit = fit_node(x, y, weights);
    const RawModel model = smoothed(index);
    Node node;
    node.samples = std::ssize(rows);
    node.rank = fit.rank;
    node.mean = fit.mean;
    node.low = fit.low;
    node.high = fit.high;
    const RowMajor known = x.array().isNaN().select(fit.mean.transpose().replicate(x.rows(), 1), x);
    const Eigen::MatrixXd left_over =
        (y - known * model.slope.transpose()).rowwise() - Eigen::RowVectorXd(model.value.transpose());
    node.rss = (weights.transpose() * left_over.cwiseAbs2()).transpose().cwiseProduct(data_.output_scale.cwiseAbs2());
    node.value = model.value.cwiseProduct(data_.output_scale) + data_.output_mean;
    node.slope = data_.output_scale.asDiagonal() * model.slope;
    return node;
  }

  /// The tree that is left, the split with the largest decrease first.
  GrownPartition finish() {
    GrownPartition result;
    result.stop = pruned_ ? StopReason::pruning : StopReason::leaf_samples;
    struct Next {
      float decrease;  // so that what is equal but for rounding is equal
      int branch;
      int node;
      bool operator<(const Next& other) const {
        return decrease != other.decrease ? decrease < other.decrease : node > other.node;
      }
    };
    std::priority_queue<Next> queue;
    const auto enter = [&](int branch) {
      const Branch& entered = branches_[static_cast<std::size_t>(branch)];
      if (entered.left >= 0) {
        queue.push({static_cast<float>(entered.split.decrease), branch, static_cast<int>(result.nodes.size())});
      }
      result.nodes.push_back(make_node(branch));
    };
    enter(0);
    const std::ptrdiff_t most = data_.problem.options.max_leaves;
    while (!queue.empty()) {
      if (most > 0 && (std::ssize(result.nodes) + 1) / 2 >= most) {
        result.stop = StopReason::max_leaves;
        break;
      }
      const Next next = queue.top();
      queue.pop();
      const Branch& branch = branches_[static_cast<std::size_t>(next.branch)];
      Node& node = result.nodes[static_cast<std::size_t>(next.node)];
      node.left = static_cast<int>(result.nodes.size());
      node.right = node.left + 1;
      node.split_input = data_.problem.options.split_inputs[static_cast<std::size_t>(branch.split.input)];
      node.threshold = branch.split.by_missing ? std::numeric_limits<double>::max() : branch.split.threshold;
      node.level_side = branch.split.level_side;
      node.missing_left = branch.missing_left;
      enter(branch.left);
      enter(branch.right);
    }
    return result;
  }

  GrowthData data_;
  RowMajor deviations_;        // of the regressors, all training rows; NaN: missing
  Eigen::VectorXd unit_;       // 1 / deviation of each output over all rows
  Eigen::VectorXd weights_;    // of the rows in the node at hand and below it
  Rows rows_;                  // those of a node one after the other
  Eigen::MatrixXd residuals_;  // of the tree below the node at hand, in the order of rows_
  std::vector<signed char> side_;
  std::vector<Branch> branches_;
  bool pruned_ = false;
};

}  // namespace

GrownPartition grow_m5(const GrowthProblem& problem) { return M5(problem).run(); }

}  // namespace llmt
