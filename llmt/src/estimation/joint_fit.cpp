#include "estimation/joint_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>

#include "base/parallel.hpp"
#include "constraints/ordered_splits.hpp"
#include "constraints/signs.hpp"
#include "numerics/bounded_least_squares.hpp"
#include "numerics/dense.hpp"
#include "numerics/forward_selection.hpp"

namespace llmt {
namespace {

// Shrinkage that is always there, in rows: nothing to what rows determine, all to what they do not.
constexpr double least_shrinkage = 1e-6;

// The same for columns that are constant in a leaf, whose variance there is rounding: relative to the leaf's weight,
// in columns of unit variance over all rows.
constexpr double least_hold = 1e-12;

// From an estimate on a sample, so many steps of conjugate gradients towards that on all rows. The sample's factor
// makes each of them gain about one digit. The length of each is measured on all rows: where a leaf has next to no
// rows in the sample, a step of length one would go far astray.
constexpr int steps_on_all_rows = 2;

// Regressors with missing values at the mean of a node's rows.
Eigen::VectorXd imputed(const Eigen::Ref<const Eigen::RowVectorXd>& deviations, const Node& node) {
  return deviations.transpose().array().isNaN().select(node.mean, deviations.transpose());
}

// Smallest and largest residual of the root's model, outputs x 2.
Eigen::MatrixXd residual_range(const TrainingRows& training, const Node& root, const std::vector<int>& outputs,
                               int max_threads) {
  Eigen::MatrixXd none(root.value.size(), 2);
  none << Eigen::VectorXd::Constant(root.value.size(), INFINITY),
      Eigen::VectorXd::Constant(root.value.size(), -INFINITY);
  std::vector<Eigen::MatrixXd> of_slot(num_slots, none);
  for_each_chunk(training, outputs, max_threads, [&](std::size_t slot, const Chunk& chunk) {
    for (Eigen::Index r = 0; r < chunk.count(); ++r) {
      const Eigen::VectorXd residual =
          chunk.outputs.row(r).transpose() - root.value - root.slope * imputed(chunk.deviations.row(r), root);
      of_slot[slot].col(0) = of_slot[slot].col(0).cwiseMin(residual);
      of_slot[slot].col(1) = of_slot[slot].col(1).cwiseMax(residual);
    }
  });
  for (const Eigen::MatrixXd& range : of_slot) {
    none.col(0) = none.col(0).cwiseMin(range.col(0));
    none.col(1) = none.col(1).cwiseMax(range.col(1));
  }
  return none;
}

}  // namespace

JointFit::JointFit(const TrainingRows& training, Partition partition, int max_threads, bool sparse)
    : training_(training),
      partition_(std::move(partition)),
      max_threads_(max_threads),
      size_(std::ssize(training.regressors) + 1) {
  const Node& root = partition_.nodes.front();
  partition_.residual_range = residual_range(training, root, partition_.outputs, max_threads);
  root_.resize(size_, root.value.size());
  root_.row(0) = root.value.transpose();
  root_.bottomRows(size_ - 1) = training.scale.asDiagonal() * root.slope.transpose();
  sums_ = assemble(training, partition_, root_, max_threads);
  signs_ = coefficient_signs(training);
  if (has_ordered_leaves()) {
    prepare_ordered_splits(partition_, training);
  }
  if (sparse) {
    selected_.resize(partition_.nodes.size());
    parallel_for(std::ssize(selected_), max_threads, [&](Eigen::Index index) {
      const std::size_t node = index;
      selected_[node] = select(node);
    });
  }
}

std::vector<Eigen::Index> JointFit::select(std::size_t node) const {
  // Of a sample, weights make it stand for all rows; it knows no more for that.
  const double rows_per_weight = static_cast<double>(training_.count()) / total_weight(training_);
  // Sums of the outputs, from those of the residuals of the root's model.
  LocalSums sums{sums_.gram[node], sums_.products[node] + sums_.gram[node] * root_, sums_.squares[node]};
  sums.squares += root_.cwiseProduct(sums.products + sums_.products[node]).colwise().sum().transpose();
  return select_regressors(sums, rows_per_weight);
}

Eigen::VectorXd JointFit::hold(std::size_t node, double shrinkage) const {
  const Eigen::MatrixXd& gram = sums_.gram[node];
  const double total = gram(0, 0);
  const double floor = least_hold * (total + 1.0);
  Eigen::VectorXd result = Eigen::VectorXd::Constant(size_, floor);
  result(0) = total > 0.0 ? 0.0 : floor;  // rows always determine the constant
  for (Eigen::Index k = 1; k < size_ && total > 0.0; ++k) {
    const double variance = std::max(0.0, (gram(k, k) - gram(0, k) * gram(0, k) / total) / total);
    result(k) += (shrinkage + least_shrinkage) * variance;
  }
  return result;
}

Eigen::MatrixXd JointFit::sparse_model(std::size_t node, const Eigen::MatrixXd& parent, double shrinkage) const {
  const std::vector<Eigen::Index>& selected = selected_[node];
  Eigen::MatrixXd start = -root_;  // so that what is not selected is 0 in all
  start(selected, Eigen::all) = parent(selected, Eigen::all);
  Eigen::MatrixXd matrix = sums_.gram[node](selected, selected);
  matrix.diagonal() += hold(node, shrinkage)(selected);
  const Eigen::MatrixXd right = (sums_.products[node] - sums_.gram[node] * start)(selected, Eigen::all);
  start(selected, Eigen::all) += matrix.llt().solve(right);
  return start;
}

std::vector<Eigen::MatrixXd> JointFit::local_models(std::size_t nodes, double shrinkage, bool sparse) const {
  const std::vector<int> parents = parents_of(partition_);
  std::vector<Eigen::MatrixXd> models(nodes);
  models[0] = Eigen::MatrixXd::Zero(size_, root_.cols());  // the root's model itself
  if (sparse && nodes == 1) {
    models[0] = sparse_model(0, models[0], 0.0);
  }
  for (std::size_t i = 1; i < nodes; ++i) {
    const Eigen::MatrixXd& parent = models[parents[i]];
    if (sparse) {
      models[i] = sparse_model(i, parent, shrinkage);
      continue;
    }
    Eigen::MatrixXd matrix = sums_.gram[i];
    matrix.diagonal() += hold(i, shrinkage);
    const Eigen::LLT<Eigen::MatrixXd> factor(matrix);
    models[i] = parent + factor.solve(sums_.products[i] - sums_.gram[i] * parent);
    for (Eigen::Index o = 0; o < root_.cols() && !signs_.empty(); ++o) {
      const Eigen::VectorXd free = models[i].col(o) + root_.col(o);
      const Eigen::VectorXd kept = nearest_with_signs(factor, free, signs_);
      if (kept != free) {
        models[i].col(o) = kept - root_.col(o);
      }
    }
  }
  return models;
}

void JointFit::set_model(Node& node, const Eigen::MatrixXd& coefficients) const {
  const Eigen::MatrixXd total = coefficients + root_;
  node.value = total.row(0).transpose();
  node.slope = total.bottomRows(size_ - 1).transpose() * training_.scale.cwiseInverse().asDiagonal();
}

Partition JointFit::with_models(Eigen::Index leaves, const std::vector<Eigen::MatrixXd>& models, bool sparse) const {
  Partition result = prefix(partition_, leaves);
  for (std::size_t i = 0; i < result.nodes.size(); ++i) {
    set_model(result.nodes[i], models[i]);
    if (sparse && (i > 0 || leaves == 1)) {
      result.nodes[i].rank = static_cast<int>(selected_[i].size());
    }
  }
  return result;
}

Partition JointFit::local(Eigen::Index leaves, double shrinkage, bool sparse) const {
  std::vector<Eigen::MatrixXd> models = local_models(2 * leaves - 1, shrinkage, sparse);
  return signs_.empty() ? with_models(leaves, models, sparse) : constrained(leaves, std::move(models), shrinkage);
}

Partition JointFit::as_grown(Eigen::Index leaves) const {
  Partition result = prefix(partition_, leaves);
  if (has_ordered_leaves()) {
    std::vector<Eigen::MatrixXd> models;
    for (const Node& node : result.nodes) {
      Eigen::MatrixXd& model = models.emplace_back(size_, root_.cols());
      model.row(0) = node.value.transpose();
      model.bottomRows(size_ - 1) = training_.scale.asDiagonal() * node.slope.transpose();
      model -= root_;
    }
    return constrained(leaves, std::move(models), 0.0);
  }
  return result;
}

JointFit::System JointFit::system(Eigen::Index leaves) const {
  const std::vector<int> parents = parents_of(partition_);
  const Eigen::Index nodes = 2 * leaves - 1;
  // Leaves of the prefix, and for every node of the whole tree the one it lies in.
  System result;
  result.leaves = leaves;
  result.position.assign(partition_.nodes.size(), -1);
  for (std::size_t i = 0; i < partition_.nodes.size(); ++i) {
    const Node& node = partition_.nodes[i];
    if (static_cast<Eigen::Index>(i) >= nodes) {
      result.position[i] = result.position[parents[i]];
    } else if (node.is_leaf() || node.left >= nodes) {
      result.position[i] = static_cast<int>(result.nodes.size());
      result.nodes.push_back(static_cast<int>(i));
    }
  }
  const Eigen::Index unknowns = std::ssize(result.nodes) * size_;
  result.matrix.setZero(unknowns, unknowns);
  for (std::size_t i = 0; i < sums_.leaves.size(); ++i) {
    const Eigen::Index row = result.position[sums_.leaves[i]];
    for (std::size_t j = 0; j <= i; ++j) {
      if (!sums_.has_block(i, j)) continue;
      const Eigen::Index column = result.position[sums_.leaves[j]];
      const Eigen::MatrixXd values = sums_.block(i, j);
      if (row <= column) {
        result.matrix.block(row * size_, column * size_, size_, size_) += values;
      }
      if (row >= column && i != j) {
        result.matrix.block(column * size_, row * size_, size_, size_) += values.transpose();
      }
    }
  }
  return result;
}

Eigen::MatrixXd JointFit::held(const System& system, const Regularisation& regularisation,
                               const Eigen::MatrixXd& change) const {
  Eigen::MatrixXd result(change.rows(), change.cols());
  for (std::size_t k = 0; k < system.nodes.size(); ++k) {
    const std::size_t node = system.nodes[k];
    const auto of_leaf = change.middleRows(static_cast<Eigen::Index>(k) * size_, size_);
    result.middleRows(static_cast<Eigen::Index>(k) * size_, size_) =
        regularisation.ridge * (sums_.gram[node] * of_leaf) +
        hold(node, regularisation.shrinkage).asDiagonal() * of_leaf;
  }
  return result;
}

std::vector<Eigen::Index> JointFit::kept_unknowns(const System& system) const {
  std::vector<Eigen::Index> kept;
  for (std::size_t k = 0; k < system.nodes.size(); ++k) {
    for (const Eigen::Index coefficient : selected_[system.nodes[k]]) {
      kept.push_back(static_cast<Eigen::Index>(k) * size_ + coefficient);
    }
  }
  return kept;
}

void JointFit::divide(const Solution& solution, Eigen::MatrixXd& right) {
  if (!solution.sparse) {
    solve_cholesky(solution.factor, right);
    return;
  }
  Eigen::MatrixXd of_kept = right(solution.kept, Eigen::all);
  solve_cholesky(solution.factor, of_kept);
  right.setZero();
  right(solution.kept, Eigen::all) = of_kept;
}

JointFit::Solution JointFit::solve(const System& system, const Regularisation& regularisation) const {
  const Eigen::Index unknowns = system.matrix.rows();
  Solution result;
  result.sparse = regularisation.sparse;
  result.local = local_models(2 * system.leaves - 1, regularisation.shrinkage, regularisation.sparse);
  if (result.sparse) {
    result.kept = kept_unknowns(system);
  }
  result.anchors.resize(unknowns, root_.cols());
  Eigen::MatrixXd right(unknowns, root_.cols());  // unknown: the change from the local estimates
  for (std::size_t k = 0; k < system.nodes.size(); ++k) {
    const std::size_t node = system.nodes[k];
    result.anchors.middleRows(static_cast<Eigen::Index>(k) * size_, size_) = result.local[node];
    right.middleRows(static_cast<Eigen::Index>(k) * size_, size_) = sums_.products[node];
  }
  right -= system.matrix.selfadjointView<Eigen::Upper>() * result.anchors;
  // Rounding can leave the matrix indefinite when the overlap is large and the ridge small.
  for (double more = 0.0; more < 1e6; more = 100.0 * std::max(more, 1e-10)) {
    result.factor = system.matrix;
    for (std::size_t k = 0; k < system.nodes.size(); ++k) {
      const std::size_t node = system.nodes[k];
      const Eigen::Index at = static_cast<Eigen::Index>(k) * size_;
      result.factor.block(at, at, size_, size_) += regularisation.ridge * sums_.gram[node];
      result.factor.diagonal().segment(at, size_) += hold(node, regularisation.shrinkage);
    }
    result.factor.diagonal().array() += more;
    if (result.sparse) {
      result.factor = RowMajor(result.factor(result.kept, result.kept));
    }
    if (factor_cholesky(result.factor)) break;
  }
  divide(result, right);
  result.coefficients = result.anchors + right;
  return result;
}

Partition JointFit::with_solution(const System& system, const Solution& solution, ActiveInequalities& active) const {
  Partition result = with_models(system.leaves, solution.local, solution.sparse);
  Eigen::MatrixXd coefficients = solution.coefficients;
  if (!signs_.empty()) {
    constrain_leaves(result, training_, system.nodes, solution.factor, root_, coefficients, active);
  }
  for (std::size_t k = 0; k < system.nodes.size(); ++k) {
    set_model(result.nodes[system.nodes[k]], coefficients.middleRows(static_cast<Eigen::Index>(k) * size_, size_));
  }
  finish_constrained(result, training_);
  return result;
}

std::vector<Partition> JointFit::joint(Eigen::Index leaves, const std::vector<Regularisation>& regularisations) const {
  const System equations = system(leaves);
  std::vector<Partition> results;
  std::map<double, ActiveInequalities> active;  // of each shrinkage: with it inner nodes change
  for (const Regularisation& regularisation : regularisations) {
    results.push_back(with_solution(equations, solve(equations, regularisation), active[regularisation.shrinkage]));
  }
  return results;
}

Eigen::MatrixXd JointFit::gradient(const TrainingRows& rows, const System& system, const Eigen::MatrixXd& coefficients,
                                   bool of_outputs) const {
  const Partition cut = prefix(partition_, system.leaves);
  const Evaluator evaluator(cut, rows.columns, size_ - 1);
  const bool leave_out = leaves_out_ambiguous(rows, evaluator);
  const Eigen::Index outputs = coefficients.cols();
  std::vector<Eigen::MatrixXd> sums(num_slots, Eigen::MatrixXd::Zero(coefficients.rows(), outputs));
  for_each_chunk(rows, partition_.outputs, max_threads_, [&](std::size_t slot, const Chunk& chunk) {
    std::vector<Activation> active;
    RowMajor x(1, size_);  // regressors as each leaf sees them; one line if no value is missing
    Eigen::VectorXd residual(outputs);
    for (Eigen::Index row = 0; row < chunk.count(); ++row) {
      const double* inputs = chunk.inputs.row(row).data();
      if (leave_out && evaluator.is_ambiguous(inputs)) continue;
      evaluator.activate(inputs, active);
      const Eigen::Index lines = rows.has_missing ? std::ssize(active) : 1;
      x.resize(lines, size_);
      for (Eigen::Index line = 0; line < lines; ++line) {
        const Node& node = cut.nodes[active[line].node];
        x(line, 0) = 1.0;
        for (Eigen::Index k = 1; k < size_; ++k) {
          const double deviation = chunk.deviations(row, k - 1);
          x(line, k) = (std::isnan(deviation) ? node.mean(k - 1) : deviation) / training_.scale(k - 1);
        }
      }
      for (Eigen::Index o = 0; o < outputs; ++o) {
        double value = of_outputs ? chunk.outputs(row, o) : 0.0;
        for (std::size_t a = 0; a < active.size(); ++a) {
          const double* of_leaf = coefficients.col(o).data() + system.position[active[a].node] * size_;
          const double* line = x.row(rows.has_missing ? static_cast<Eigen::Index>(a) : 0).data();
          double sum = 0.0;
          for (Eigen::Index k = 0; k < size_; ++k) {
            sum += of_leaf[k] * line[k];
          }
          value -= active[a].validity * sum;
        }
        value *= chunk.weights(row);
        for (std::size_t a = 0; a < active.size(); ++a) {
          double* to = sums[slot].col(o).data() + system.position[active[a].node] * size_;
          const double* line = x.row(rows.has_missing ? static_cast<Eigen::Index>(a) : 0).data();
          for (Eigen::Index k = 0; k < size_; ++k) {
            to[k] += active[a].validity * value * line[k];
          }
        }
      }
    }
  });
  for (std::size_t slot = 1; slot < sums.size(); ++slot) {
    sums[0] += sums[slot];
  }
  return std::move(sums[0]);
}

Partition JointFit::joint_on(const TrainingRows& all, Eigen::Index leaves, const Regularisation& regularisation) const {
  const System equations = system(leaves);
  Solution solution = solve(equations, regularisation);
  Eigen::MatrixXd& coefficients = solution.coefficients;
  Eigen::MatrixXd residual =
      gradient(all, equations, coefficients + root_.replicate(std::ssize(equations.nodes), 1), true) +
      held(equations, regularisation, solution.anchors - coefficients);
  Eigen::MatrixXd direction = Eigen::MatrixXd::Zero(residual.rows(), residual.cols());
  Eigen::RowVectorXd before = Eigen::RowVectorXd::Ones(residual.cols());
  for (int step = 0; step < steps_on_all_rows; ++step) {
    Eigen::MatrixXd conditioned = residual;
    divide(solution, conditioned);
    const Eigen::RowVectorXd now = residual.cwiseProduct(conditioned).colwise().sum();
    direction = conditioned + direction * now.cwiseQuotient(before).asDiagonal();
    before = now;
    const Eigen::MatrixXd product =
        held(equations, regularisation, direction) - gradient(all, equations, direction, false);
    const Eigen::RowVectorXd curvature = direction.cwiseProduct(product).colwise().sum();
    if (!(now.minCoeff() > 0.0 && curvature.minCoeff() > 0.0)) break;
    const Eigen::RowVectorXd length = now.cwiseQuotient(curvature);
    coefficients += direction * length.asDiagonal();
    residual -= product * length.asDiagonal();
  }
  ActiveInequalities none;
  Partition result = with_solution(equations, solution, none);
  result.residual_range = residual_range(all, result.nodes.front(), partition_.outputs, max_threads_);
  return result;
}

}  // namespace llmt
