#include "estimation/joint_equations.hpp"

#include "base/count.hpp"
#include "numerics/dense.hpp"
#include "partition/tree.hpp"

namespace llmt {
namespace {

// Rounding can leave the matrix indefinite when the overlap is large and the ridge small. Then this is added to its
// diagonal, ever more until it is positive definite.
constexpr double first_addition = 1e-8;
constexpr double growth_of_addition = 100.0;
constexpr int most_additions = 8;

// Sets leaf_nodes, and position for every node of the tree.
void find_leaves(const Partition& tree, JointEquations& equations) {
  const std::vector<int> parents = parents_of(tree);
  const Eigen::Index nodes = 2 * equations.leaves - 1;
  equations.position.assign(tree.nodes.size(), -1);
  for (int i = 0; i < std::ssize(tree.nodes); ++i) {
    const Node& node = tree.nodes[i];
    if (i >= nodes) {
      equations.position[i] = equations.position[parents[i]];
    } else if (node.is_leaf() || node.left >= nodes) {
      equations.position[i] = count_of(equations.leaf_nodes);
      equations.leaf_nodes.push_back(i);
    }
  }
}

std::vector<Eigen::Index> sparse_unknowns(const LeafSums& sums, const JointEquations& equations) {
  std::vector<Eigen::Index> unknowns;
  Eigen::Index first = 0;
  for (const int node : equations.leaf_nodes) {
    for (const Eigen::Index coefficient : sums.selected[node]) {
      unknowns.push_back(first + coefficient);
    }
    first += sums.size();
  }
  return unknowns;
}

// The Cholesky factor of the regularised matrix of the unknowns.
RowMajor factor_of(const LeafSums& sums, const JointEquations& equations, const Regularisation& regularisation,
                   const std::vector<Eigen::Index>& unknowns) {
  const Eigen::Index size = sums.size();
  RowMajor factor;
  double addition = 0.0;
  for (int attempt = 0; attempt <= most_additions; ++attempt) {
    factor = equations.matrix;
    Eigen::Index at = 0;
    for (const int node : equations.leaf_nodes) {
      factor.block(at, at, size, size) += regularisation.ridge * sums.equations.gram[node];
      factor.diagonal().segment(at, size) += shrinkage_diagonal(sums, node, regularisation.shrinkage);
      at += size;
    }
    factor.diagonal().array() += addition;
    if (regularisation.sparse) {
      factor = RowMajor(factor(unknowns, unknowns));
    }
    if (factor_cholesky(factor)) break;
    addition = attempt == 0 ? first_addition : growth_of_addition * addition;
  }
  return factor;
}

}  // namespace

JointEquations joint_equations(const LeafSums& sums, Eigen::Index leaves) {
  const Eigen::Index size = sums.size();
  JointEquations result;
  result.leaves = leaves;
  find_leaves(sums.partition, result);
  const Eigen::Index unknowns = std::ssize(result.leaf_nodes) * size;
  result.matrix.setZero(unknowns, unknowns);
  const NormalEquations& equations = sums.equations;
  for (int i = 0; i < std::ssize(equations.leaves); ++i) {
    const Eigen::Index row = result.position[equations.leaves[i]];
    for (const auto& [j, packed] : equations.blocks[i]) {
      const Eigen::Index column = result.position[equations.leaves[j]];
      const Eigen::MatrixXd values = equations.block(i, j);
      if (row <= column) {
        result.matrix.block(row * size, column * size, size, size) += values;
      }
      if (row >= column && i != j) {
        result.matrix.block(column * size, row * size, size, size) += values.transpose();
      }
    }
  }
  return result;
}

JointSolution solve(const LeafSums& sums, const JointEquations& equations, const Regularisation& regularisation,
                    const std::vector<Eigen::MatrixXd>& local) {
  const Eigen::Index size = sums.size();
  JointSolution result;
  FreeEstimate& estimate = result.estimate;
  estimate.sparse = regularisation.sparse;
  estimate.models = local;
  if (regularisation.sparse) {
    result.unknowns = sparse_unknowns(sums, equations);
  }
  result.anchors.resize(equations.matrix.rows(), sums.root.cols());
  Eigen::MatrixXd right(equations.matrix.rows(), sums.root.cols());
  Eigen::Index at = 0;
  for (const int node : equations.leaf_nodes) {
    result.anchors.middleRows(at, size) = estimate.models[node];
    right.middleRows(at, size) = sums.equations.products[node];
    at += size;
  }
  // The unknown is the change from the anchors.
  right -= equations.matrix.selfadjointView<Eigen::Upper>() * result.anchors;
  estimate.factor = factor_of(sums, equations, regularisation, result.unknowns);
  estimate.leaf_coefficients = result.anchors + times_inverse(result, right);
  return result;
}

Eigen::MatrixXd times_inverse(const JointSolution& solution, const Eigen::MatrixXd& right) {
  if (!solution.estimate.sparse) {
    Eigen::MatrixXd result = right;
    solve_cholesky(solution.estimate.factor, result);
    return result;
  }
  Eigen::MatrixXd of_unknowns = right(solution.unknowns, Eigen::all);
  solve_cholesky(solution.estimate.factor, of_unknowns);
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(right.rows(), right.cols());
  result(solution.unknowns, Eigen::all) = of_unknowns;
  return result;
}

Eigen::MatrixXd times_regularisation(const LeafSums& sums, const JointEquations& equations,
                                     const Regularisation& regularisation, const Eigen::MatrixXd& change) {
  const Eigen::Index size = sums.size();
  Eigen::MatrixXd result(change.rows(), change.cols());
  Eigen::Index at = 0;
  for (const int node : equations.leaf_nodes) {
    const auto of_leaf = change.middleRows(at, size);
    result.middleRows(at, size) = regularisation.ridge * (sums.equations.gram[node] * of_leaf) +
                                  shrinkage_diagonal(sums, node, regularisation.shrinkage).asDiagonal() * of_leaf;
    at += size;
  }
  return result;
}

}  // namespace llmt
