/// \file
/// Estimation of the local models of a partition under its validities: locally weighted, or all at once.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "constraints/constrained_leaves.hpp"
#include "data/dataset.hpp"
#include "estimation/normal_equations.hpp"
#include "model/evaluator.hpp"

namespace llmt {

/// How strongly estimates are held.
struct Regularisation {
  double ridge = 0.0;      ///< joint estimates at the local ones
  double shrinkage = 0.0;  ///< local estimates at the parent's, see Candidate::shrinkage
  bool sparse = false;     ///< slopes that forward selection leaves out are 0
};

/// Weighted least squares of the outputs on Phi_i [1, x] over all leaves i of a partition, and of all its prefixes.
///
/// The joint estimate minimises
///   sum_n q_n (y_n - sum_i Phi_i(x_n) a_n' w_i)^2 + ridge * sum_i (w_i - w_i^local)' G_i (w_i - w_i^local)
/// with a = [1, x], q the weights of the rows, G_i = sum_n q_n Phi_i a a', and w_i^local the locally weighted estimate
/// w_parent + (X' Q_i X + H_i)^-1 X' Q_i (y - X w_parent), Q_i = diag(q_n Phi_i(x_n)): ridge 0 is global estimation, a
/// large ridge local estimation (Nelles 2001, 13.2). H_i shrinks towards the parent: `shrinkage` rows of the variance
/// that each column has in the leaf, uncorrelated. Where rows do not determine a direction, the parent's stays. Without
/// overlap and shrinkage both estimates are those of the crisp tree.
///
/// The validity of an inner node is the sum of the validities below it, so one pass over the rows serves every prefix
/// of the tree. Normal equations in columns scaled over all rows, for the residuals of the root's model.
///
/// Sparse estimates have the coefficients that select_regressors() takes from G_i and b_i; nothing is selected anew in
/// joint estimation. The root keeps its full model where there are more leaves, for guards refer to it.
class JointFit {
 public:
  /// `partition`: half widths set, local models as grown. `training` must live as long as this. `sparse`: whether
  /// sparse estimates will be asked for.
  JointFit(const TrainingRows& training, Partition partition, int max_threads, bool sparse = false);

  /// The prefix with `leaves` leaves and the joint estimates for each ridge and shrinkage, in order.
  std::vector<Partition> joint(Eigen::Index leaves, const std::vector<Regularisation>& regularisations) const;

  /// One joint estimate on the rows `all`, of which this fit's are a sample that stands for them: from the estimate on
  /// the sample by conjugate gradients, preconditioned with it. Local estimates and hold are those of the sample.
  Partition joint_on(const TrainingRows& all, Eigen::Index leaves, const Regularisation& regularisation) const;

  /// The prefix with `leaves` leaves and locally weighted estimates.
  Partition local(Eigen::Index leaves, double shrinkage, bool sparse = false) const;

  /// The prefix as grown, with the ranges of the validities.
  Partition as_grown(Eigen::Index leaves) const;

  /// Whether leaves have to be in order across some split, so that only estimates of the same prefix keep it.
  bool has_ordered_leaves() const;

 private:
  /// The normal equations of a prefix.
  struct System {
    Eigen::Index leaves = 0;
    std::vector<int> nodes;     // its leaves
    std::vector<int> position;  // of every node at or below one of them: that leaf's among `nodes`; else -1
    RowMajor matrix;            // upper triangle
  };
  struct Solution {
    bool sparse = false;
    std::vector<Eigen::MatrixXd> local;  // of every node
    Eigen::MatrixXd anchors;             // of the leaves, one below the other
    Eigen::MatrixXd coefficients;
    std::vector<Eigen::Index> kept;  // unknowns of a sparse estimate
    RowMajor factor;                 // of the matrix of the unknowns
  };

  System system(Eigen::Index leaves) const;
  Solution solve(const System& system, const Regularisation& regularisation) const;
  /// Coefficients of the unknowns of a sparse estimate.
  std::vector<Eigen::Index> kept_unknowns(const System& system) const;
  /// Replaces `right` by the factored matrix' inverse times it; 0 where a sparse estimate has no unknown.
  static void divide(const Solution& solution, Eigen::MatrixXd& right);
  Partition with_solution(const System& system, const Solution& solution, ActiveInequalities& active) const;
  /// The models of a prefix's nodes, leaves each estimated for itself, under the constraints.
  Partition constrained(Eigen::Index leaves, std::vector<Eigen::MatrixXd> models, double shrinkage) const;
  /// What holds the leaves' coefficients, times a change of them.
  Eigen::MatrixXd held(const System& system, const Regularisation& regularisation, const Eigen::MatrixXd& change) const;
  /// sum_n q_n Phi_i a r over `rows`, r what the coefficients leave of the outputs, or of zero.
  Eigen::MatrixXd gradient(const TrainingRows& rows, const System& system, const Eigen::MatrixXd& coefficients,
                           bool of_outputs) const;
  /// Of all nodes, size x outputs, about the root's model.
  std::vector<Eigen::MatrixXd> local_models(std::size_t nodes, double shrinkage, bool sparse) const;
  /// Of one node, with the selected coefficients alone. `parent`: its parent's model, for the root its own full one.
  Eigen::MatrixXd sparse_model(std::size_t node, const Eigen::MatrixXd& parent, double shrinkage) const;
  Partition with_models(Eigen::Index leaves, const std::vector<Eigen::MatrixXd>& models, bool sparse) const;
  /// The coefficients that the rows of a node ask for.
  std::vector<Eigen::Index> select(std::size_t node) const;
  Eigen::VectorXd hold(std::size_t node, double shrinkage) const;
  void set_model(Node& node, const Eigen::MatrixXd& coefficients) const;

  const TrainingRows& training_;
  Partition partition_;
  int max_threads_;
  Eigen::Index size_;     // coefficients of a local model
  Eigen::MatrixXd root_;  // coefficients of the root's model
  NormalEquations sums_;
  std::vector<std::vector<Eigen::Index>> selected_;  // coefficients of every node's sparse model
  std::vector<int> signs_;                           // of the coefficients; empty: none
};

}  // namespace llmt
