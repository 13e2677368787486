/// \file
/// Preconditioned conjugate gradients.
#pragma once

#include <Eigen/Core>

namespace llmt {

/// Takes conjugate-gradient steps from `solution` towards the X that solves A X = B, A symmetric positive definite
/// (Hestenes & Stiefel 1952). The columns of B have steps of their own, which end together.
///
/// `residual`: B - A X at the start. `multiply(D)` returns A D. `precondition(R)` returns P R, where P is an
/// approximation of the inverse of A. The steps end after `most_steps`; or when R' P R of some column is no larger than
/// `enough` times its first value; or when rounding has made A look indefinite along a direction.
template <class Multiply, class Precondition>
void conjugate_gradients(const Multiply& multiply, const Precondition& precondition, int most_steps, double enough,
                         Eigen::MatrixXd residual, Eigen::MatrixXd& solution) {
  Eigen::MatrixXd direction = Eigen::MatrixXd::Zero(residual.rows(), residual.cols());
  Eigen::RowVectorXd before = Eigen::RowVectorXd::Ones(residual.cols());
  Eigen::RowVectorXd small_enough;
  for (int step = 0; step < most_steps; ++step) {
    const Eigen::MatrixXd conditioned = precondition(residual);
    const Eigen::RowVectorXd now = residual.cwiseProduct(conditioned).colwise().sum();
    if (step == 0) small_enough = enough * now;
    if (!(now.array() > small_enough.array()).all()) return;
    direction = conditioned + direction * now.cwiseQuotient(before).asDiagonal();
    before = now;
    const Eigen::MatrixXd product = multiply(direction);
    const Eigen::RowVectorXd curvature = direction.cwiseProduct(product).colwise().sum();
    if (!(curvature.array() > 0.0).all()) return;
    const Eigen::RowVectorXd length = now.cwiseQuotient(curvature);
    solution += direction * length.asDiagonal();
    residual -= product * length.asDiagonal();
  }
}

}  // namespace llmt
