/// Decompositions of dense matrices that decompositions.cpp compiles once for all. Only the precompiled headers have
/// this file: a source without it compiles the same code again, up to 7 s for each decomposition that it uses.
#pragma once

#include <Eigen/Dense>

#ifndef LLMT_DECOMPOSITION
#define LLMT_DECOMPOSITION extern template
#endif

namespace Eigen {

LLMT_DECOMPOSITION void HouseholderQR<MatrixXd>::computeInPlace();
LLMT_DECOMPOSITION void ColPivHouseholderQR<MatrixXd>::computeInPlace();
LLMT_DECOMPOSITION void CompleteOrthogonalDecomposition<MatrixXd>::computeInPlace();
LLMT_DECOMPOSITION JacobiSVD<MatrixXd>& JacobiSVD<MatrixXd>::compute(const MatrixXd&, unsigned);
LLMT_DECOMPOSITION LLT<MatrixXd>& LLT<MatrixXd>::compute(const EigenBase<MatrixXd>&);
LLMT_DECOMPOSITION LDLT<MatrixXd>& LDLT<MatrixXd>::compute(const EigenBase<MatrixXd>&);
LLMT_DECOMPOSITION SelfAdjointEigenSolver<MatrixXd>& SelfAdjointEigenSolver<MatrixXd>::compute(
    const EigenBase<MatrixXd>&, int);

// `solve` calls these.
LLMT_DECOMPOSITION void ColPivHouseholderQR<MatrixXd>::_solve_impl(const VectorXd&, VectorXd&) const;
LLMT_DECOMPOSITION void CompleteOrthogonalDecomposition<MatrixXd>::_solve_impl(const VectorXd&, VectorXd&) const;
LLMT_DECOMPOSITION void LLT<MatrixXd>::_solve_impl(const VectorXd&, VectorXd&) const;
LLMT_DECOMPOSITION void LLT<MatrixXd>::_solve_impl(const MatrixXd&, MatrixXd&) const;
LLMT_DECOMPOSITION void LDLT<MatrixXd>::_solve_impl(const VectorXd&, VectorXd&) const;

}  // namespace Eigen
