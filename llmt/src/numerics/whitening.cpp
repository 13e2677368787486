#include "numerics/whitening.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "base/simd.hpp"

namespace llmt {
namespace {

LLMT_FOR_EACH_INSTRUCTION_SET
void transform(double* row, std::ptrdiff_t rows, std::ptrdiff_t stride, std::ptrdiff_t regressors, const double* matrix,
               double* result) {
  const std::ptrdiff_t width = (regressors + lanes - 1) / lanes * lanes;
  for (std::ptrdiff_t i = 0; i < rows; ++i, row += stride) {
    const double* z = row + 1;
    for (std::ptrdiff_t c = 0; c < width; c += lanes) {
      Lanes sum = {};
      const std::ptrdiff_t last = std::min(regressors, c + lanes);
      for (std::ptrdiff_t k = 0; k < last; ++k) {
        sum += z[k] * *reinterpret_cast<const Lanes*>(matrix + k * width + c);
      }
      *reinterpret_cast<Lanes*>(result + c) = sum;
    }
    for (std::ptrdiff_t k = 0; k < regressors; ++k) {
      row[1 + k] = result[k];
    }
  }
}

/// Columns behind the regressors have coefficient zero; what stands behind the row is finite.
LLMT_FOR_EACH_INSTRUCTION_SET
void subtract(double* row, std::ptrdiff_t rows, std::ptrdiff_t stride, std::ptrdiff_t width, std::ptrdiff_t residual,
              const double* coefficients, double* products, double* squares) {
  for (std::ptrdiff_t i = 0; i < rows; ++i, row += stride) {
    Lanes fit = {};
    for (std::ptrdiff_t c = 0; c < width; c += lanes) {
      fit += *reinterpret_cast<const Lanes*>(row + c) * *reinterpret_cast<const Lanes*>(coefficients + c);
    }
    const double value = ((fit[0] + fit[4]) + (fit[1] + fit[5])) + ((fit[2] + fit[6]) + (fit[3] + fit[7]));
    const double left = row[residual] - value;
    row[residual] = left;
    for (std::ptrdiff_t c = 0; c < width; c += lanes) {
      *reinterpret_cast<Lanes*>(products + c) += left * *reinterpret_cast<const Lanes*>(row + c);
    }
    *squares += left * left;
  }
}

}  // namespace

void transform_regressors(Features& features, const std::vector<double>& matrix) {
  const std::ptrdiff_t regressors = features.coefficients() - 1;
  std::vector<double> result(static_cast<std::size_t>(regressors + lanes));
  transform(features.row(0), features.rows(), features.columns(), regressors, matrix.data(), result.data());
}

Remainder subtract_fit(Features& features, std::ptrdiff_t output, const std::vector<double>& coefficients) {
  const std::ptrdiff_t width = (features.coefficients() + lanes - 1) / lanes * lanes;
  std::vector<double> padded = coefficients;
  padded.resize(static_cast<std::size_t>(width), 0.0);
  Remainder remainder{std::vector<double>(padded.size(), 0.0), 0.0};
  subtract(features.row(0), features.rows(), features.columns(), width, features.coefficients() + output, padded.data(),
           remainder.products.data(), &remainder.squares);
  remainder.products.resize(static_cast<std::size_t>(features.coefficients()));
  return remainder;
}

Whitening whiten(const Eigen::MatrixXd& covariance) {
  const std::ptrdiff_t size = covariance.rows();
  Whitening result{Eigen::MatrixXd::Zero(size, size), Eigen::MatrixXd::Zero(size, size), 0};
  if (size == 0) {
    return result;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(covariance);
  const double smallest = covariance_tolerance * std::max(eigen.eigenvalues().maxCoeff(), 0.0);
  for (std::ptrdiff_t k = size; k-- > 0;) {
    if (const double value = eigen.eigenvalues()(k); value > smallest && value > 0.0) {
      result.forward.col(result.rank) = eigen.eigenvectors().col(k) / std::sqrt(value);
      result.back.col(result.rank) = eigen.eigenvectors().col(k) * std::sqrt(value);
      ++result.rank;
    }
  }
  return result;
}

}  // namespace llmt
