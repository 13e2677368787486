/// \file
/// The two dense kernels in which joint estimation spends its time.
///
/// They are compiled for several instruction sets; the best one that the machine has is chosen when the program starts.
/// All of them form sums in the same order and without fused multiply-add, so the bytes of a result do not depend on
/// the machine.
#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "base/matrix.hpp"

namespace llmt {

/// Adds sign * A' B to C: A is depth x rows, B depth x columns, C rows x columns, all stored row by row with the given
/// distances between rows. C may not overlap A or B.
void add_transposed_product(Eigen::Index rows, Eigen::Index columns, Eigen::Index depth, double sign, const double* a,
                            Eigen::Index a_stride, const double* b, Eigen::Index b_stride, double* c,
                            Eigen::Index c_stride);

/// Factors a symmetric positive definite matrix S = U' U in place: the upper triangle of `matrix` (row by row) holds S,
/// then U. Returns false, leaving the matrix undefined, if a pivot is not positive.
bool factor_cholesky(RowMajor& matrix);

/// Solves U' U X = B in place.
void solve_cholesky(const RowMajor& factor, Eigen::MatrixXd& right);

}  // namespace llmt
