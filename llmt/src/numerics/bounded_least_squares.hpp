/// \file
/// Least squares under linear inequalities (docs/algorithms/constraints.md).
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <vector>

namespace llmt {

/// Least-distance programming: the shortest vector y with normals' y >= bounds. Inequalities can be added between
/// solutions. Every least-squares problem under inequalities has this form in the coordinates of its Cholesky factor.
///
/// Solved in the multipliers l, min 1/2 l'Gl - b'l over l >= 0 with G the Gram matrix of the normals, by an active-set
/// method like that of Lawson & Hanson (1974, ch. 23): the inequality that is violated most enters the active set;
/// inequalities whose multipliers would become negative leave it. Every step lowers the objective. The method starts
/// from the active set of the last solution. Before that, all wrong inequalities are exchanged at once a few times,
/// which is enough in most cases.
class LeastDistance {
 public:
  explicit LeastDistance(Eigen::Index dimensions) : normals_(dimensions, 0) {}

  /// One column, not zero, per inequality. Columns are scaled to length 1.
  void add(const Eigen::MatrixXd& normals, const Eigen::VectorXd& bounds);

  /// Drops all inequalities but the active ones; returns the positions that these had. The next solution is no shorter.
  std::vector<Eigen::Index> keep_active();

  /// The solution. If no vector meets all inequalities, one that nearly does.
  Eigen::VectorXd solve();

  /// The multiplier of each inequality, in the order in which they were added, for columns of length 1; >= 0.
  const Eigen::VectorXd& multipliers() const { return multipliers_; }

 private:
  bool exchange(const Eigen::VectorXd& tolerance);
  void enter(Eigen::Index c);
  void leave(Eigen::Index position);

  Eigen::MatrixXd normals_;
  Eigen::MatrixXd gram_;
  Eigen::VectorXd bounds_;
  Eigen::VectorXd multipliers_;
  std::vector<Eigen::Index> active_;
  Eigen::MatrixXd factor_;  // lower Cholesky factor of their Gram matrix, in the corner
};

/// The w nearest to `free` in the norm of `matrix`, (w - free)' matrix (w - free), with signs_k w_k >= 0: where `free`
/// is the least-squares solution with this Gram matrix, least squares under the signs. Entries whose sign constraint is
/// active are exactly 0. The matrix is given by its Cholesky factor.
Eigen::VectorXd nearest_with_signs(const Eigen::LLT<Eigen::MatrixXd>& matrix, const Eigen::VectorXd& free,
                                   const std::vector<int>& signs);

}  // namespace llmt
