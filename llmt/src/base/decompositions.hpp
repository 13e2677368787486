/// Decompositions and products of dense matrices that decompositions.cpp compiles once for all. Only the precompiled
/// headers have this file: a source without it compiles the same code again, up to 7 s for each decomposition that it
/// uses.
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
LLMT_DECOMPOSITION LLT<Matrix3d>& LLT<Matrix3d>::compute(const EigenBase<Matrix3d>&);
LLMT_DECOMPOSITION LDLT<MatrixXd>& LDLT<MatrixXd>::compute(const EigenBase<MatrixXd>&);
LLMT_DECOMPOSITION LDLT<Matrix3d>& LDLT<Matrix3d>::compute(const EigenBase<Matrix3d>&);
LLMT_DECOMPOSITION SelfAdjointEigenSolver<MatrixXd>& SelfAdjointEigenSolver<MatrixXd>::compute(
    const EigenBase<MatrixXd>&, int);

// `solve` calls these.
LLMT_DECOMPOSITION void HouseholderQR<MatrixXd>::_solve_impl(const VectorXd&, VectorXd&) const;
LLMT_DECOMPOSITION void ColPivHouseholderQR<MatrixXd>::_solve_impl(const VectorXd&, VectorXd&) const;
LLMT_DECOMPOSITION void CompleteOrthogonalDecomposition<MatrixXd>::_solve_impl(const VectorXd&, VectorXd&) const;
LLMT_DECOMPOSITION void CompleteOrthogonalDecomposition<MatrixXd>::_solve_impl(const MatrixXd&, MatrixXd&) const;
LLMT_DECOMPOSITION void CompleteOrthogonalDecomposition<MatrixXd>::_solve_impl(const MatrixXd::IdentityReturnType&,
                                                                               MatrixXd&) const;
LLMT_DECOMPOSITION void LLT<MatrixXd>::_solve_impl(const VectorXd&, VectorXd&) const;
LLMT_DECOMPOSITION void LLT<MatrixXd>::_solve_impl(const MatrixXd&, MatrixXd&) const;
LLMT_DECOMPOSITION void LLT<Matrix3d>::_solve_impl(const Vector3d&, Vector3d&) const;
LLMT_DECOMPOSITION void LDLT<MatrixXd>::_solve_impl(const VectorXd&, VectorXd&) const;
LLMT_DECOMPOSITION void LDLT<Matrix3d>::_solve_impl(const Vector3d&, Vector3d&) const;

}  // namespace Eigen

// What products, triangular solves and reflections come down to. The names are internal, so they are those of one
// version.
#if EIGEN_WORLD_VERSION == 3 && EIGEN_MAJOR_VERSION == 4 && EIGEN_MINOR_VERSION == 0
namespace Eigen {

using RowOfQ = const Transpose<const Block<const Block<const MatrixXd, 1, Dynamic>, 1, Dynamic>>;
LLMT_DECOMPOSITION void MatrixBase<Block<MatrixXd>>::applyHouseholderOnTheLeft(const Block<const MatrixXd, Dynamic, 1>&,
                                                                               const double&, double*);
LLMT_DECOMPOSITION void MatrixBase<Block<MatrixXd>>::applyHouseholderOnTheLeft(RowOfQ&, const double&, double*);
LLMT_DECOMPOSITION void MatrixBase<Block<MatrixXd>>::applyHouseholderOnTheRight(
    const Block<const MatrixXd, Dynamic, 1>&, const double&, double*);
LLMT_DECOMPOSITION void MatrixBase<Block<VectorXd, Dynamic, Dynamic>>::applyHouseholderOnTheLeft(
    const Block<const MatrixXd, Dynamic, 1>&, const double&, double*);

namespace internal {

using Double = gebp_traits<double, double>;
using ByColumn = const_blas_data_mapper<double, Index, ColMajor>;
using ByRow = const_blas_data_mapper<double, Index, RowMajor>;
using Result = blas_data_mapper<double, Index, ColMajor>;

LLMT_DECOMPOSITION struct gebp_kernel<double, double, Index, Result, Double::mr, Double::nr, false, false>;
LLMT_DECOMPOSITION struct gemm_pack_lhs<double, Index, ByColumn, Double::mr, Double::LhsProgress,
                                        Double::LhsPacket4Packing, ColMajor>;
LLMT_DECOMPOSITION struct gemm_pack_lhs<double, Index, ByRow, Double::mr, Double::LhsProgress,
                                        Double::LhsPacket4Packing, RowMajor>;
LLMT_DECOMPOSITION struct gemm_pack_rhs<double, Index, ByColumn, Double::nr, ColMajor>;
LLMT_DECOMPOSITION struct gemm_pack_rhs<double, Index, ByRow, Double::nr, RowMajor>;
LLMT_DECOMPOSITION struct gemm_pack_rhs<double, Index, Result, Double::nr, ColMajor, false, true>;

LLMT_DECOMPOSITION struct general_matrix_vector_product<Index, double, ByColumn, ColMajor, false, double, ByColumn,
                                                        false>;
LLMT_DECOMPOSITION struct general_matrix_vector_product<Index, double, ByColumn, ColMajor, false, double, ByRow, false>;
LLMT_DECOMPOSITION struct general_matrix_vector_product<Index, double, ByRow, RowMajor, false, double, ByColumn, false>;
LLMT_DECOMPOSITION struct general_matrix_vector_product<Index, double, ByRow, RowMajor, false, double, ByRow, false, 1>;

LLMT_DECOMPOSITION struct triangular_solve_matrix<double, Index, OnTheLeft, Lower, false, ColMajor, ColMajor, 1>;
LLMT_DECOMPOSITION struct triangular_solve_matrix<double, Index, OnTheLeft, Upper, false, ColMajor, ColMajor, 1>;
LLMT_DECOMPOSITION struct triangular_solve_matrix<double, Index, OnTheLeft, Upper, false, RowMajor, ColMajor, 1>;
LLMT_DECOMPOSITION struct triangular_solve_matrix<double, Index, OnTheRight, Upper, false, RowMajor, ColMajor, 1>;
LLMT_DECOMPOSITION struct triangular_solve_vector<double, double, Index, OnTheLeft, Lower, false, ColMajor>;
LLMT_DECOMPOSITION struct triangular_solve_vector<double, double, Index, OnTheLeft, Upper, false, ColMajor>;
LLMT_DECOMPOSITION struct triangular_solve_vector<double, double, Index, OnTheLeft, Upper, false, RowMajor>;
LLMT_DECOMPOSITION struct triangular_solve_vector<double, double, Index, OnTheLeft, UnitLower, false, ColMajor>;
LLMT_DECOMPOSITION struct triangular_solve_vector<double, double, Index, OnTheLeft, UnitUpper, false, RowMajor>;

LLMT_DECOMPOSITION struct product_triangular_matrix_matrix<double, Index, Upper, true, RowMajor, false, ColMajor, false,
                                                           ColMajor, 1>;
LLMT_DECOMPOSITION struct product_triangular_matrix_matrix<double, Index, Lower, true, ColMajor, false, ColMajor, false,
                                                           ColMajor, 1>;
LLMT_DECOMPOSITION struct product_triangular_matrix_matrix<double, Index, UnitUpper, true, RowMajor, false, ColMajor,
                                                           false, ColMajor, 1>;
LLMT_DECOMPOSITION struct product_triangular_matrix_matrix<double, Index, UnitLower, true, ColMajor, false, ColMajor,
                                                           false, ColMajor, 1>;

using RowMajorXd = Matrix<double, Dynamic, Dynamic, RowMajor>;
LLMT_DECOMPOSITION void make_block_householder_triangular_factor(RowMajorXd&, const Block<MatrixXd>&,
                                                                 const VectorBlock<const VectorXd>&);
LLMT_DECOMPOSITION void make_block_householder_triangular_factor(RowMajorXd&, const Block<MatrixXd>&,
                                                                 const Block<const VectorXd, Dynamic, 1>&);
LLMT_DECOMPOSITION void apply_block_householder_on_the_left(Block<MatrixXd>&, const Block<MatrixXd>&,
                                                            const VectorBlock<const VectorXd>&, bool);

LLMT_DECOMPOSITION Index llt_inplace<double, Lower>::unblocked(MatrixXd&);
LLMT_DECOMPOSITION Index llt_inplace<double, Lower>::unblocked(Block<MatrixXd>&);

template <class Left, class Right>
using DenseProduct = generic_product_impl<Left, Right, DenseShape, DenseShape, GemmProduct>;
LLMT_DECOMPOSITION void DenseProduct<MatrixXd, MatrixXd>::scaleAndAddTo(MatrixXd&, const MatrixXd&, const MatrixXd&,
                                                                        const double&);
LLMT_DECOMPOSITION void DenseProduct<Transpose<const MatrixXd>, MatrixXd>::scaleAndAddTo(
    MatrixXd&, const Transpose<const MatrixXd>&, const MatrixXd&, const double&);
LLMT_DECOMPOSITION void DenseProduct<Transpose<MatrixXd>, MatrixXd>::scaleAndAddTo(MatrixXd&,
                                                                                   const Transpose<MatrixXd>&,
                                                                                   const MatrixXd&, const double&);

}  // namespace internal
}  // namespace Eigen
#endif
