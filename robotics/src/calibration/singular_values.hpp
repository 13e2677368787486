// Singular values of a tall matrix.
#pragma once

#include <Eigen/Core>

namespace llmt::robotics {

/// min(n, k), falling, of an n x k matrix: of the triangle of its QR factorisation, so that nothing is squared.
Eigen::VectorXd singular_values(const Eigen::MatrixXd& matrix);

}  // namespace llmt::robotics
