#include "constraints/constrained_leaves.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "constraints/monotone_splits.hpp"
#include "constraints/signs.hpp"
#include "numerics/bounded_least_squares.hpp"

namespace llmt {
namespace {

// The feasibility margin of estimates at ordered splits, in ranges of the root's residuals. Rounding may use it up.
constexpr double margin_in_ranges = 1e-6;

// A slope violates its sign beyond this, in ranges of the root's residuals for each unit of a column of unit size.
constexpr double tolerance_in_ranges = 1e-11;

// Rounds of cutting planes. finish_constrained() mends what is still violated then.
constexpr int most_rounds = 20;

double margin_of(const Partition& partition, Eigen::Index output) {
  return margin_in_ranges * (partition.residual_range(output, 1) - partition.residual_range(output, 0));
}

// [value, slopes] of all nodes, one column each.
Eigen::MatrixXd models_of(const Partition& partition, Eigen::Index output) {
  const Eigen::Index regressors = partition.nodes.front().slope.cols();
  Eigen::MatrixXd models(regressors + 1, std::ssize(partition.nodes));
  for (Eigen::Index i = 0; i < models.cols(); ++i) {
    const Node& node = partition.nodes[i];
    models(0, i) = node.value(output);
    models.col(i).tail(regressors) = node.slope.row(output).transpose();
  }
  return models;
}

// The constraints on the leaves' coefficients of one output.
class LeafProblem {
 public:
  LeafProblem(const Partition& partition, const TrainingRows& training, const std::vector<int>& leaves,
              const Eigen::VectorXd& root, Eigen::Index output)
      : leaves_(leaves),
        root_(root),
        signs_(coefficient_signs(training)),
        splits_(partition, training, output),
        models_(models_of(partition, output)),
        margin_(margin_of(partition, output)),
        tolerance_(tolerance_in_ranges / margin_in_ranges * margin_),
        position_(partition.nodes.size(), -1),
        unit_(Eigen::VectorXd::Ones(root.size())) {
    unit_.tail(root.size() - 1) = training.scale.cwiseInverse();
    for (std::size_t k = 0; k < leaves.size(); ++k) {
      position_[leaves[k]] = k;
    }
  }

  std::vector<LeafInequality> violated(const Eigen::VectorXd& coefficients) {
    const Eigen::Index size = root_.size();
    std::vector<LeafInequality> result;
    if (!splits_.empty()) {
      for (std::size_t k = 0; k < leaves_.size(); ++k) {
        const auto of_leaf = coefficients.segment(k * size, size);
        models_.col(leaves_[k]) = (of_leaf + root_).cwiseProduct(unit_);
      }
      result = splits_.violated(models_, 0.5 * margin_, margin_);
    }
    for (Eigen::Index at = 0; at < coefficients.size() && !signs_.empty(); ++at) {
      const int sign = signs_[at % size];
      if (sign * (coefficients(at) + root_(at % size)) < -tolerance_) {
        const int leaf = leaves_[at / size];
        result.push_back({leaf, leaf, sign * Eigen::VectorXd::Unit(size, at % size), Eigen::VectorXd::Zero(size), 0.0});
      }
    }
    return result;
  }

  // The inequalities in the form normals' change >= bounds, for a change of the coefficients.
  Eigen::MatrixXd normals(const std::vector<LeafInequality>& found, const Eigen::VectorXd& coefficients,
                          Eigen::VectorXd& bounds) const {
    const Eigen::Index size = root_.size();
    Eigen::MatrixXd result = Eigen::MatrixXd::Zero(coefficients.size(), std::ssize(found));
    bounds.resize(std::ssize(found));
    for (Eigen::Index column = 0; column < std::ssize(found); ++column) {
      const Eigen::VectorXd left = found[column].of_left.cwiseProduct(unit_);
      const Eigen::VectorXd right = found[column].of_right.cwiseProduct(unit_);
      result.col(column).segment(position_[found[column].left] * size, size) += left;
      result.col(column).segment(position_[found[column].right] * size, size) += right;
      bounds(column) = found[column].bound - (left + right).dot(root_);
    }
    bounds -= result.transpose() * coefficients;
    return result;
  }

 private:
  const std::vector<int>& leaves_;
  Eigen::VectorXd root_;
  std::vector<int> signs_;
  OrderedSplits splits_;
  Eigen::MatrixXd models_;
  double margin_;
  double tolerance_;
  std::vector<Eigen::Index> position_;  // of a leaf's node among the leaves
  Eigen::VectorXd unit_;                // natural coefficients are scaled ones times this
};

}  // namespace

void constrain_leaves(const Partition& partition, const TrainingRows& training, const std::vector<int>& leaves,
                      const RowMajor& factor, const Eigen::MatrixXd& root, Eigen::MatrixXd& coefficients,
                      ActiveInequalities& active) {
  active.resize(coefficients.cols());
  for (Eigen::Index o = 0; o < coefficients.cols(); ++o) {
    std::vector<LeafInequality>& start = active[o];
    LeafProblem problem(partition, training, leaves, root.col(o), o);
    const Eigen::VectorXd free = coefficients.col(o);
    std::vector<LeafInequality> found = problem.violated(free);
    if (found.empty()) {
      start.clear();
      continue;
    }
    found.insert(found.begin(), start.begin(), start.end());
    std::vector<LeafInequality> all;
    LeastDistance distance(free.size());
    for (int round = 0; round < most_rounds && !found.empty(); ++round) {
      Eigen::VectorXd bounds;
      Eigen::MatrixXd normals = problem.normals(found, free, bounds);
      factor.triangularView<Eigen::Upper>().transpose().solveInPlace(normals);
      distance.add(normals, bounds);
      all.insert(all.end(), found.begin(), found.end());
      Eigen::VectorXd change = distance.solve();
      // Inequalities that are not active are dropped. If they are violated later they are found again. This ends,
      // because no round makes the change smaller.
      std::vector<LeafInequality> kept;
      for (const Eigen::Index c : distance.keep_active()) {
        kept.push_back(std::move(all[c]));
      }
      all = std::move(kept);
      factor.triangularView<Eigen::Upper>().solveInPlace(change);
      coefficients.col(o) = free + change;
      found = problem.violated(coefficients.col(o));
    }
    start = std::move(all);
  }
}

void finish_constrained(Partition& partition, const TrainingRows& training) {
  const std::vector<int> signs = coefficient_signs(training);
  if (signs.empty()) return;
  for (Node& node : partition.nodes) {
    for (Eigen::Index k = 0; k < node.slope.cols(); ++k) {
      const int sign = signs[k + 1];
      for (Eigen::Index o = 0; sign != 0 && o < node.slope.rows(); ++o) {
        node.slope(o, k) = sign * node.slope(o, k) > 0.0 ? node.slope(o, k) : 0.0;
      }
    }
  }
  if (!has_ordered_splits(partition, training)) return;
  for (Eigen::Index o = 0; o < std::ssize(partition.outputs); ++o) {
    Eigen::MatrixXd models = models_of(partition, o);
    OrderedSplits(partition, training, o).separate(models, margin_of(partition, o));
    for (std::size_t i = 0; i < partition.nodes.size(); ++i) {
      partition.nodes[i].value(o) = models(0, i);
    }
  }
}

double order_margin(const Partition& partition, const TrainingRows& training) {
  double least = std::numeric_limits<double>::infinity();
  for (Eigen::Index o = 0; o < std::ssize(partition.outputs) && has_ordered_splits(partition, training); ++o) {
    least = std::min(least, OrderedSplits(partition, training, o).smallest_margin(models_of(partition, o)));
  }
  return least;
}

}  // namespace llmt
