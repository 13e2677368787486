#include "growth/m5/growth.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <queue>

#include "growth/m5/model.hpp"
#include "growth/m5/tree.hpp"
#include "numerics/node_fit.hpp"

namespace llmt {
namespace {

using Rows = std::vector<int>;

// A subtree does not stay if one model leaves less than this part of it: what is left is rounding.
constexpr double negligible_error = 1e-5;

// Rows that the model of a node counts as when that of its child is drawn towards it (Quinlan 1992).
constexpr double smoothing_rows = 15.0;

class M5 {
 public:
  explicit M5(const GrowthProblem& problem) : data_(problem), tree_(grow_m5_tree(data_)) {
    const Eigen::Index regressors = std::ssize(data_.training.regressors);
    deviations_.resize(data_.training.count(), regressors);
    for (Eigen::Index index = 0; index < num_chunks(data_.training); ++index) {
      const Chunk chunk = fetch(data_.training, index, {});
      deviations_.middleRows(index * chunk_rows, chunk.count()) = chunk.deviations;
    }
    unit_ = (data_.output_weights * data_.weights.sum()).cwiseSqrt();
  }

  GrownPartition run() {
    const Eigen::Index grown = std::ssize(tree_.branches);
    residuals_.resize(data_.training.count(), data_.outputs.cols());
    // Children stand after their parents: backwards is from the leaves up.
    for (Eigen::Index i = grown; i-- > 0;) {
      prune(i);
    }
    return finish();
  }

 private:
  // Regressors of the inputs that are tested at or below a node; of a tree that tests none all, for one model is all
  // that is left then.
  std::vector<int> regressors_of(const M5Branch& branch) const {
    std::vector<int> result;
    const std::vector<Regressor>& regressors = data_.training.regressors;
    if (tree_.branches.size() == 1) {
      result.resize(regressors.size());
      std::iota(result.begin(), result.end(), 0);
      return result;
    }
    for (std::size_t k = 0; k < regressors.size(); ++k) {
      for (std::size_t j = 0; j < branch.tested.size(); ++j) {
        if (branch.tested[j] && data_.problem.options.split_inputs[j] == regressors[k].input) {
          result.push_back(static_cast<int>(k));
        }
      }
    }
    return result;
  }

  // Regressors of some rows, missing values at the means of the rows.
  RowMajor regressors_at(const Rows& rows, const std::vector<int>& columns, const Eigen::VectorXd& weights) const {
    RowMajor x = deviations_(rows, columns);
    for (Eigen::Index k = 0; data_.training.has_missing && k < x.cols(); ++k) {
      double sum = 0.0;
      double present = 0.0;
      for (Eigen::Index i = 0; i < x.rows(); ++i) {
        sum += std::isnan(x(i, k)) ? 0.0 : weights(i) * x(i, k);
        present += std::isnan(x(i, k)) ? 0.0 : weights(i);
      }
      const double mean = present > 0.0 ? sum / present : 0.0;
      x.col(k) = x.col(k).array().isNaN().select(mean, x.col(k));
    }
    return x;
  }

  // Fits the node's model and lets it take the place of the subtree, the children of which are done, unless that has
  // the smaller adjusted error.
  void prune(std::size_t index) {
    M5Branch& branch = tree_.branches[index];
    for (const auto& [row, weight] : branch.shared) {
      tree_.weights(row) = weight;
    }
    const std::span<int> own = tree_.rows_of(branch);
    const Rows rows(own.begin(), own.end());
    const Eigen::VectorXd weights = tree_.weights(rows);
    const Eigen::Index outputs = data_.outputs.cols();
    const bool is_leaf = branch.left < 0;
    if (!is_leaf) {
      for (std::size_t j = 0; j < branch.tested.size(); ++j) {
        branch.tested[j] =
            branch.tested[j] || tree_.branches[branch.left].tested[j] || tree_.branches[branch.right].tested[j];
      }
    }
    const std::vector<int> columns = regressors_of(branch);
    const RowMajor x = regressors_at(rows, columns, weights);
    M5Model& model = branch.model;
    model.value.resize(outputs);
    model.slope = Eigen::MatrixXd::Zero(outputs, deviations_.cols());
    model.coefficients.resize(outputs);
    Eigen::MatrixXd residuals(std::ssize(rows), outputs);
    double of_model = 0.0;
    double of_subtree = 0.0;
    Eigen::VectorXd below = Eigen::VectorXd::Zero(outputs);
    for (Eigen::Index o = 0; o < outputs; ++o) {
      FewInputsModel fit = fit_few_inputs(x, data_.outputs.col(o)(rows), weights);
      model.value(o) = fit.value;
      model.slope.row(o)(columns) = fit.slope.transpose();
      model.coefficients(o) = fit.coefficients;
      residuals.col(o) = fit.residuals;
      of_model += unit_(o) * adjusted_error(fit.rms, branch.weight, fit.coefficients);
      if (!is_leaf) {
        below(o) = tree_.branches[branch.left].model.coefficients(o) +
                   tree_.branches[branch.right].model.coefficients(o) + 1.0;
        // Rows of neither child count alike on both sides.
        const Eigen::Index neither = tree_.branches[branch.right].end - branch.begin;
        for (Eigen::Index k = neither; k < std::ssize(rows); ++k) {
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

  // The smoothed model of a node: from below, p' = (n p + 15 q) / (n + 15) with the model q of each ancestor and the
  // weight n of its child on the path.
  M5Model smoothed(int index) const {
    const M5Branch* child = &tree_.branches[index];
    M5Model result = child->model;
    for (int at = child->parent; at >= 0; at = child->parent) {
      const M5Branch& ancestor = tree_.branches[at];
      const double share = child->weight / (child->weight + smoothing_rows);
      result.value = share * result.value + (1.0 - share) * ancestor.model.value;
      result.slope = share * result.slope + (1.0 - share) * ancestor.model.slope;
      child = &ancestor;
    }
    return result;
  }

  Node make_node(int index) {
    const M5Branch& branch = tree_.branches[index];
    const std::span<int> own = tree_.rows_of(branch);
    const Rows rows(own.begin(), own.end());
    const Eigen::VectorXd weights = data_.weights(rows);
    const RowMajor x = deviations_(rows, Eigen::all);
    const Eigen::MatrixXd y = data_.outputs(rows, Eigen::all);
    const NodeFit fit = fit_node(x, y, weights);
    const M5Model model = smoothed(index);
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

  // The tree that is left, the split with the largest decrease first.
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
      const M5Branch& entered = tree_.branches[branch];
      if (entered.left >= 0) {
        queue.push({static_cast<float>(entered.split.decrease), branch, static_cast<int>(result.nodes.size())});
      }
      result.nodes.push_back(make_node(branch));
    };
    enter(0);
    const Eigen::Index most = data_.problem.options.max_leaves;
    while (!queue.empty()) {
      if (most > 0 && (std::ssize(result.nodes) + 1) / 2 >= most) {
        result.stop = StopReason::max_leaves;
        break;
      }
      const Next next = queue.top();
      queue.pop();
      const M5Branch& branch = tree_.branches[next.branch];
      Node& node = result.nodes[next.node];
      node.left = static_cast<int>(result.nodes.size());
      node.right = node.left + 1;
      node.split_input = data_.problem.options.split_inputs[branch.split.input];
      node.threshold = branch.split.by_missing ? std::numeric_limits<double>::max() : branch.split.threshold;
      node.level_side = branch.split.level_side;
      node.missing_left = branch.missing_left;
      enter(branch.left);
      enter(branch.right);
    }
    return result;
  }

  GrowthData data_;
  M5Tree tree_;
  RowMajor deviations_;        // of the regressors, all training rows; NaN: missing
  Eigen::VectorXd unit_;       // 1 / deviation of each output over all rows
  Eigen::MatrixXd residuals_;  // of the tree below the node at hand, in the order of the tree's rows
  bool pruned_ = false;
};

}  // namespace

GrownPartition grow_m5(const GrowthProblem& problem) { return M5(problem).run(); }

}  // namespace llmt
