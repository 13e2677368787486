#include "growth/m5/pruning.hpp"

#include <cmath>
#include <numeric>

#include "data/missing.hpp"
#include "growth/m5/model.hpp"
#include "partition/imputed.hpp"

namespace llmt {
namespace {

using Rows = std::vector<int>;

// One model takes the place of a subtree if its adjusted error is below this part of the outputs' standard deviations:
// what is left is rounding.
constexpr double negligible_error = 1e-5;

// Regressors of the inputs that are tested at or below a node. In a tree without splits these are all regressors, for
// one model is all that is left.
std::vector<int> regressors_of(const GrowthData& data, const M5Tree& tree, const M5Branch& branch) {
  const std::vector<Regressor>& regressors = data.training.regressors;
  std::vector<int> result;
  if (tree.branches.size() == 1) {
    result.resize(regressors.size());
    std::iota(result.begin(), result.end(), 0);
    return result;
  }
  for (int k = 0; k < std::ssize(regressors); ++k) {
    for (std::size_t j = 0; j < branch.tested.size(); ++j) {
      if (branch.tested[j] && data.problem.options.split_inputs[j] == regressors[k].input) {
        result.push_back(k);
      }
    }
  }
  return result;
}

class Pruner {
 public:
  Pruner(const GrowthData& data, const RowMajor& deviations, M5Tree& tree)
      : data_(data),
        deviations_(deviations),
        tree_(tree),
        unit_((data.output_weights * data.total_weight).cwiseSqrt()),
        residuals_(data.training.count(), data.outputs.cols()) {}

  bool run();

 private:
  void prune(M5Branch& branch);
  void restore_weights(const M5Branch& branch);
  void collect_tested(M5Branch& branch) const;
  RowMajor regressors_at(const Rows& rows, const std::vector<int>& columns, const Eigen::VectorXd& weights) const;
  Eigen::MatrixXd fit(const Rows& rows, const Eigen::VectorXd& weights, M5Branch& branch, double& error) const;
  double error_of_subtree(const M5Branch& branch, const Eigen::VectorXd& weights,
                          const Eigen::VectorXd& coefficients) const;
  Eigen::VectorXd coefficients_below(const M5Branch& branch) const;

  const GrowthData& data_;
  const RowMajor& deviations_;
  M5Tree& tree_;
  Eigen::VectorXd unit_;       // 1 / standard deviation of each output over all rows
  Eigen::MatrixXd residuals_;  // of the leaves below the node at hand, in the order of the tree's rows
  bool pruned_ = false;
};

bool Pruner::run() {
  // Children stand after their parents: backwards is from the leaves up.
  for (Eigen::Index i = std::ssize(tree_.branches); i-- > 0;) {
    prune(tree_.branches[i]);
  }
  return pruned_;
}

// The children of the node are done.
void Pruner::prune(M5Branch& branch) {
  restore_weights(branch);
  collect_tested(branch);
  const std::span<int> own = tree_.rows_of(branch);
  const Rows rows(own.begin(), own.end());
  const Eigen::VectorXd weights = tree_.weights(rows);
  const Eigen::Index count = std::ssize(rows);
  double of_model = 0.0;
  const Eigen::MatrixXd residuals = fit(rows, weights, branch, of_model);
  const bool is_leaf = branch.left < 0;
  if (!is_leaf) {
    // Rows of neither child count alike on both sides of the comparison.
    const Eigen::Index neither = tree_.branches[branch.right].end - branch.begin;
    residuals_.middleRows(branch.begin + neither, count - neither) = residuals.bottomRows(count - neither);
    const Eigen::VectorXd below = coefficients_below(branch);
    const double negligible = negligible_error * static_cast<double>(data_.outputs.cols());
    if (of_model > error_of_subtree(branch, weights, below) && of_model >= negligible) {
      branch.model.coefficients = below;
      return;
    }
    pruned_ = true;
  }
  branch.left = branch.right = -1;
  residuals_.middleRows(branch.begin, count) = residuals;
}

// Rows that a child has in part count in full here.
void Pruner::restore_weights(const M5Branch& branch) {
  for (const auto& [row, weight] : branch.shared) {
    tree_.weights(row) = weight;
  }
}

// Adds the split inputs that are tested below the node to those that it tests itself.
void Pruner::collect_tested(M5Branch& branch) const {
  if (branch.left < 0) return;
  for (std::size_t j = 0; j < branch.tested.size(); ++j) {
    const bool below = tree_.branches[branch.left].tested[j] || tree_.branches[branch.right].tested[j];
    branch.tested[j] = branch.tested[j] || below;
  }
}

// Missing values are taken at the means of the rows.
RowMajor Pruner::regressors_at(const Rows& rows, const std::vector<int>& columns,
                               const Eigen::VectorXd& weights) const {
  const RowMajor x = deviations_(rows, columns);
  if (!data_.training.has_missing) return x;
  Eigen::VectorXd mean(x.cols());
  for (Eigen::Index k = 0; k < x.cols(); ++k) {
    mean(k) = mean_of_present(x, k, weights);
  }
  return imputed(x, mean);
}

// Sets the node's model and `error`, its adjusted error summed over the outputs in units of their deviations. Returns
// the residuals, rows x outputs.
Eigen::MatrixXd Pruner::fit(const Rows& rows, const Eigen::VectorXd& weights, M5Branch& branch, double& error) const {
  const Eigen::Index outputs = data_.outputs.cols();
  const std::vector<int> columns = regressors_of(data_, tree_, branch);
  const RowMajor x = regressors_at(rows, columns, weights);
  M5Model& model = branch.model;
  model.value.resize(outputs);
  model.slope = Eigen::MatrixXd::Zero(outputs, deviations_.cols());
  model.coefficients.resize(outputs);
  Eigen::MatrixXd residuals(std::ssize(rows), outputs);
  error = 0.0;
  for (Eigen::Index o = 0; o < outputs; ++o) {
    const FewInputsModel fit = fit_few_inputs(x, data_.outputs.col(o)(rows), weights);
    model.value(o) = fit.value;
    model.slope.row(o)(columns) = fit.slope.transpose();
    model.coefficients(o) = fit.coefficients;
    residuals.col(o) = fit.residuals;
    error += unit_(o) * adjusted_error(fit.rms, branch.weight, fit.coefficients);
  }
  return residuals;
}

// Coefficients of the children's models or subtrees and one more for the split, per output.
Eigen::VectorXd Pruner::coefficients_below(const M5Branch& branch) const {
  const M5Model& left = tree_.branches[branch.left].model;
  const M5Model& right = tree_.branches[branch.right].model;
  return (left.coefficients + right.coefficients).array() + 1.0;
}

// Adjusted error of the leaves below the node, as in fit().
double Pruner::error_of_subtree(const M5Branch& branch, const Eigen::VectorXd& weights,
                                const Eigen::VectorXd& coefficients) const {
  double error = 0.0;
  for (Eigen::Index o = 0; o < data_.outputs.cols(); ++o) {
    const Eigen::VectorXd left_over = residuals_.col(o).segment(branch.begin, weights.size());
    const double rms = std::sqrt(weights.dot(left_over.cwiseAbs2()) / branch.weight);
    error += unit_(o) * adjusted_error(rms, branch.weight, coefficients(o));
  }
  return error;
}

}  // namespace

bool prune_m5_tree(const GrowthData& data, const RowMajor& deviations, M5Tree& tree) {
  return Pruner(data, deviations, tree).run();
}

}  // namespace llmt
