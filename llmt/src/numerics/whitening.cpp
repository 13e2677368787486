#include "numerics/whitening.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "base/simd.hpp"
#include "numerics/tolerances.hpp"

namespace llmt {
namespace {

template <class Lanes>
LLMT_INLINE void transform(double* row, Eigen::Index rows, Eigen::Index stride, Eigen::Index regressors,
                           const double* matrix, double* result) {
  const Eigen::Index width = (regressors + lanes - 1) / lanes * lanes;
  for (Eigen::Index i = 0; i < rows; ++i, row += stride) {
    const double* z = row + 1;
    for (Eigen::Index c = 0; c < width; c += lanes) {
      Lanes sum = {};
      const Eigen::Index last = std::min(regressors, c + lanes);
      for (Eigen::Index k = 0; k < last; ++k) {
        sum += z[k] * *reinterpret_cast<const Lanes*>(matrix + k * width + c);
      }
      *reinterpret_cast<Lanes*>(result + c) = sum;
    }
    for (Eigen::Index k = 0; k < regressors; ++k) {
      row[1 + k] = result[k];
    }
  }
}

// Rows are read in whole vectors: columns behind the regressors have coefficient zero, and the numbers behind the last
// row are finite.
template <class Lanes>
LLMT_INLINE void subtract(double* row, Eigen::Index rows, Eigen::Index stride, Eigen::Index width,
                          Eigen::Index residual, const double* coefficients, double* products, double* squares) {
  for (Eigen::Index i = 0; i < rows; ++i, row += stride) {
    Lanes fit = {};
    for (Eigen::Index c = 0; c < width; c += lanes) {
      fit += *reinterpret_cast<const Lanes*>(row + c) * *reinterpret_cast<const Lanes*>(coefficients + c);
    }
    const double value = ((fit[0] + fit[4]) + (fit[1] + fit[5])) + ((fit[2] + fit[6]) + (fit[3] + fit[7]));
    const double left = row[residual] - value;
    row[residual] = left;
    for (Eigen::Index c = 0; c < width; c += lanes) {
      *reinterpret_cast<Lanes*>(products + c) += left * *reinterpret_cast<const Lanes*>(row + c);
    }
    *squares += left * left;
  }
}

}  // namespace

void transform_regressors(Features& features, const std::vector<double>& matrix) {
  const Eigen::Index regressors = features.coefficients() - 1;
  std::vector<double> result(regressors + lanes);
  with_widest_registers([&](auto eight) LLMT_INLINE_LAMBDA {
    transform<decltype(eight)>(features.row(0), features.rows(), features.columns(), regressors, matrix.data(),
                               result.data());
  });
}

Remainder subtract_fit(Features& features, Eigen::Index output, const std::vector<double>& coefficients) {
  const Eigen::Index width = (features.coefficients() + lanes - 1) / lanes * lanes;
  std::vector<double> padded = coefficients;
  padded.resize(width, 0.0);
  Remainder remainder{std::vector<double>(padded.size(), 0.0), 0.0};
  with_widest_registers([&](auto eight) LLMT_INLINE_LAMBDA {
    subtract<decltype(eight)>(features.row(0), features.rows(), features.columns(), width,
                              features.coefficients() + output, padded.data(), remainder.products.data(),
                              &remainder.squares);
  });
  remainder.products.resize(features.coefficients());
  return remainder;
}

Whitening whiten(const Eigen::MatrixXd& covariance) {
  const Eigen::Index size = covariance.rows();
  Whitening result{Eigen::MatrixXd::Zero(size, size), Eigen::MatrixXd::Zero(size, size), 0};
  if (size == 0) return result;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(covariance);
  const double smallest = collinearity_tolerance * std::max(eigen.eigenvalues().maxCoeff(), 0.0);
  for (Eigen::Index k = size; k-- > 0;) {
    if (const double value = eigen.eigenvalues()(k); value > smallest && value > 0.0) {
      result.forward.col(result.rank) = eigen.eigenvectors().col(k) / std::sqrt(value);
      result.back.col(result.rank) = eigen.eigenvectors().col(k) * std::sqrt(value);
      ++result.rank;
    }
  }
  return result;
}

}  // namespace llmt
