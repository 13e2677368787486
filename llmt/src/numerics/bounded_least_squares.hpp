/// \file
/// Least squares under linear inequalities (docs/algorithms.md, monotone and sign constraints).
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <vector>

namespace llmt {

/// The shortest vector y with normals' y >= bounds, for inequalities that come little by little (least distance
/// programming: every least-squares problem under inequalities is one in the coordinates of its Cholesky factor).
///
/// Solved in the multipliers, min 1/2 l'Gl - b'l over l >= 0 with G the Gram matrix of the normals, by an active set
/// like that of Lawson & Hanson (1974, ch. 23): the inequality that is violated most enters, those whose multipliers
/// would become negative leave. Every step gains, and it goes on from the active set that it had. Before that all wrong
/// inequalities are exchanged at once a few times, which mostly is enough.
class LeastDistance {
 public:
  explicit LeastDistance(Eigen::Index dimensions) : normals_(dimensions, 0) {}

  /// One column, not zero, per inequality. Columns are scaled to length 1.
  void add(const Eigen::MatrixXd& normals, const Eigen::VectorXd& bounds);

  /// Forgets all inequalities but the active ones; returns where these stood. The next solution is no shorter.
  std::vector<Eigen::Index> keep_active();

  /// The solution. If no vector meets all inequalities, one that comes near.
  Eigen::VectorXd solve();

  /// Of the inequalities in the order they were added, with columns of length 1; >= 0.
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
/// is the least-squares solution with this Gram matrix, least squares under the signs. Entries that a sign holds are
/// exactly 0. The matrix is given factored.
Eigen::VectorXd nearest_with_signs(const Eigen::LLT<Eigen::MatrixXd>& matrix, const Eigen::VectorXd& free,
                                   const std::vector<int>& signs);

}  // namespace llmt
