#include "estimation/local_estimate.hpp"

#include <Eigen/Cholesky>

#include "estimation/constrained_estimate.hpp"
#include "numerics/bounded_least_squares.hpp"
#include "numerics/wide_ridge.hpp"
#include "partition/tree.hpp"

namespace llmt {
namespace {

// A node's sparse model: its selected coefficients, drawn towards `parent` there. For a root without leaves `parent` is
// its own full model.
Eigen::MatrixXd sparse_model(const LeafSums& sums, std::size_t node, const Eigen::MatrixXd& parent, double shrinkage) {
  const std::vector<Eigen::Index>& selected = sums.selected[node];
  const Eigen::MatrixXd& gram = sums.equations.gram[node];
  // Coefficients are relative to the root's model, so those that are not selected are 0 in the sum of both.
  Eigen::MatrixXd model = -sums.root;
  model(selected, Eigen::all) = parent(selected, Eigen::all);
  Eigen::MatrixXd matrix = gram(selected, selected);
  matrix.diagonal() += shrinkage_diagonal(sums, node, shrinkage)(selected);
  const Eigen::MatrixXd right = (sums.equations.products[node] - gram * model)(selected, Eigen::all);
  model(selected, Eigen::all) += matrix.llt().solve(right);
  return model;
}

// From this number of coefficients for each row on, wide_ridge() is faster.
constexpr Eigen::Index coefficients_per_row = 4;

// A node's full model, under the signs of its slopes.
Eigen::MatrixXd full_model(const LeafSums& sums, std::size_t node, const Eigen::MatrixXd& parent, double shrinkage) {
  const Eigen::MatrixXd& gram = sums.equations.gram[node];
  const Eigen::MatrixXd right = sums.equations.products[node] - gram * parent;
  const Eigen::VectorXd diagonal = shrinkage_diagonal(sums, node, shrinkage);
  const Eigen::Index rows = sums.training->count();
  if (sums.signs.empty() && sums.size() > coefficients_per_row * rows) {
    return parent + wide_ridge(gram, diagonal, right, rows);
  }
  Eigen::MatrixXd matrix = gram;
  matrix.diagonal() += diagonal;
  const Eigen::LLT<Eigen::MatrixXd> factor(matrix);
  Eigen::MatrixXd model = parent + factor.solve(right);
  for (Eigen::Index o = 0; o < model.cols() && !sums.signs.empty(); ++o) {
    const Eigen::VectorXd free = model.col(o) + sums.root.col(o);
    const Eigen::VectorXd constrained = nearest_with_signs(factor, free, sums.signs);
    if (constrained != free) {
      model.col(o) = constrained - sums.root.col(o);
    }
  }
  return model;
}

// The model with slopes of 0, relative to the root's.
Eigen::MatrixXd without_slopes(const LeafSums& sums) {
  Eigen::MatrixXd model = -sums.root;
  model.row(0).setZero();
  return model;
}

}  // namespace

std::vector<Eigen::MatrixXd> local_models(const LeafSums& sums, std::size_t nodes, double shrinkage, bool sparse) {
  const std::vector<int> parents = parents_of(sums.partition);
  std::vector<Eigen::MatrixXd> models(nodes);
  models[0] = Eigen::MatrixXd::Zero(sums.size(), sums.root.cols());
  if (sparse && nodes == 1) {
    models[0] = sparse_model(sums, 0, models[0], 0.0);
  } else if (nodes == 1 && shrinkage > 0.0) {
    models[0] = full_model(sums, 0, without_slopes(sums), shrinkage);
  }
  for (std::size_t i = 1; i < nodes; ++i) {
    const Eigen::MatrixXd& parent = models[parents[i]];
    models[i] = sparse ? sparse_model(sums, i, parent, shrinkage) : full_model(sums, i, parent, shrinkage);
  }
  return models;
}

Partition local(const LeafSums& sums, Eigen::Index leaves, double shrinkage, bool sparse) {
  std::vector<Eigen::MatrixXd> models = local_models(sums, 2 * leaves - 1, shrinkage, sparse);
  if (sums.signs.empty()) return with_models(sums, leaves, models, sparse);
  return constrained_one_by_one(sums, leaves, models, shrinkage);
}

Partition as_grown(const LeafSums& sums, Eigen::Index leaves) {
  Partition result = grown_prefix(sums.partition, leaves);
  if (!has_ordered_leaves(sums)) return result;
  std::vector<Eigen::MatrixXd> models;
  for (const Node& node : result.nodes) {
    Eigen::MatrixXd& model = models.emplace_back(sums.size(), sums.root.cols());
    model.row(0) = node.value.transpose();
    model.bottomRows(sums.size() - 1) = sums.training->scale.asDiagonal() * node.slope.transpose();
    model -= sums.root;
  }
  return constrained_one_by_one(sums, leaves, models, 0.0);
}

}  // namespace llmt
