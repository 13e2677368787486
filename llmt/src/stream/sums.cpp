#include "stream/sums.hpp"

#include <algorithm>
#include <cmath>

#include "base/count.hpp"
#include "base/simd.hpp"
#include "numerics/tolerances.hpp"

namespace llmt {
namespace {

template <class Lanes>
LLMT_INLINE void multiply(const double* features, Eigen::Index columns, double* products) {
  for (Eigen::Index i = 0; i < columns; ++i) {
    double* out = products + GramShape::row_begin(i);
    for (Eigen::Index j = 0; j <= i; j += lanes) {
      *reinterpret_cast<Lanes*>(out + j) = features[i] * *reinterpret_cast<const Lanes*>(features + j);
    }
  }
}

}  // namespace

void Sums::clear() {
  std::ranges::fill(gram, 0.0);
  rows = 0;
}

void Sums::add(const GramShape& shape, const Sums& other) {
  llmt::add(shape, other.gram.data(), gram.data());
  rows += other.rows;
}

RowProducts::RowProducts(const GramShape& shape)
    : shape_(shape), features_((shape.columns() + lanes - 1) / lanes * lanes, 0.0), products_(shape.size(), 0.0) {}

void RowProducts::set(const Basis& basis, const double* z, double y, double weight) {
  const Eigen::Index coefficients = shape_.coefficients();
  const double root = std::sqrt(weight);
  double residual = y - basis.base(0);
  features_[0] = root;
  for (Eigen::Index k = 1; k < coefficients; ++k) {
    const double deviation = z[k - 1] - basis.origin(k - 1);
    const double known = deviation == deviation ? deviation : 0.0;
    residual -= basis.base(k) * known;
    features_[k] = root * known;
  }
  features_[coefficients] = root * residual;
  with_widest_registers([&](auto eight) LLMT_INLINE_LAMBDA {
    multiply<decltype(eight)>(features_.data(), shape_.columns(), products_.data());
  });
}

void RowProducts::add_to(double* gram) const { llmt::add(shape_, products_.data(), gram); }

Eigen::MatrixXd matrix_of(const GramShape& shape, const double* gram) {
  Eigen::MatrixXd matrix(shape.columns(), shape.columns());
  for (Eigen::Index i = 0; i < shape.columns(); ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      matrix(i, j) = matrix(j, i) = gram[shape.at(i, j)];
    }
  }
  return matrix;
}

namespace {

// Means and scales of the columns in a Gram matrix.
struct Moments {
  double total;          // weight
  Eigen::VectorXd mean;  // of the coefficients' columns, the constant's first
  double residual_mean;
  Eigen::VectorXd scale;  // root of the sum of squares about the mean; 0: the column does not vary
};

Moments moments_of(const GramShape& shape, const double* gram) {
  const Eigen::Index size = shape.coefficients();
  Moments result{gram[0], Eigen::VectorXd(size), gram[shape.at(size, 0)] / gram[0], Eigen::VectorXd::Zero(size)};
  for (Eigen::Index k = 0; k < size; ++k) {
    result.mean(k) = gram[shape.at(k, 0)] / result.total;
  }
  for (Eigen::Index k = 1; k < size; ++k) {
    const double square = gram[shape.at(k, k)];
    const double variance = square - result.total * result.mean(k) * result.mean(k);
    result.scale(k) = variance > pivot_tolerance * square ? std::sqrt(variance) : 0.0;
  }
  return result;
}

// Cholesky factor of the correlation matrix of the regressors that are independent of those before them.
struct CorrelationFactor {
  Eigen::MatrixXd factor;  // in the rows and columns `kept`
  Eigen::VectorXd right;   // its inverse times the correlations with the residual
  std::vector<Eigen::Index> kept;
};

CorrelationFactor factorise(const GramShape& shape, const double* gram, const Moments& moments, double shrinkage) {
  const Eigen::Index size = shape.coefficients();
  const auto& [total, mean, residual_mean, scale] = moments;
  CorrelationFactor result{Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size), {}};
  Eigen::MatrixXd& factor = result.factor;
  const double added_to_diagonal = shrinkage / total;
  for (Eigen::Index k = 1; k < size; ++k) {
    if (!(scale(k) > 0.0)) continue;
    double pivot = 1.0 + added_to_diagonal;
    for (const Eigen::Index j : result.kept) {
      double sum = (gram[shape.at(k, j)] - total * mean(k) * mean(j)) / (scale(k) * scale(j));
      for (const Eigen::Index m : result.kept) {
        if (m >= j) break;
        sum -= factor(k, m) * factor(j, m);
      }
      factor(k, j) = sum / factor(j, j);
      pivot -= factor(k, j) * factor(k, j);
    }
    if (!(pivot > collinearity_tolerance)) continue;
    factor(k, k) = std::sqrt(pivot);
    double sum = (gram[shape.at(size, k)] - total * mean(k) * residual_mean) / scale(k);
    for (const Eigen::Index j : result.kept) {
      sum -= factor(k, j) * result.right(j);
    }
    result.right(k) = sum / factor(k, k);
    result.kept.push_back(k);
  }
  return result;
}

}  // namespace

Eigen::VectorXd solve(const GramShape& shape, const double* gram, double shrinkage, int& rank) {
  Eigen::VectorXd change = Eigen::VectorXd::Zero(shape.coefficients());
  rank = 0;
  if (!(gram[0] > 0.0)) return change;
  const Moments moments = moments_of(shape, gram);
  const auto [factor, right, kept] = factorise(shape, gram, moments, shrinkage);
  rank = 1 + count_of(kept);
  for (Eigen::Index at = std::ssize(kept) - 1; at >= 0; --at) {
    const Eigen::Index k = kept[at];
    double sum = right(k);
    for (Eigen::Index later = at + 1; later < std::ssize(kept); ++later) {
      const Eigen::Index m = kept[later];
      sum -= factor(m, k) * change(m);
    }
    change(k) = sum / factor(k, k);
  }
  change(0) = moments.residual_mean;
  for (const Eigen::Index k : kept) {
    change(k) /= moments.scale(k);
    change(0) -= change(k) * moments.mean(k);
  }
  return change;
}

double remaining(const GramShape& shape, const double* gram, const Eigen::VectorXd& change) {
  const Eigen::Index size = shape.coefficients();
  double sum = gram[shape.at(size, size)];
  for (Eigen::Index i = 0; i < size; ++i) {
    sum -= 2.0 * change(i) * gram[shape.at(size, i)];
    for (Eigen::Index j = 0; j < size; ++j) {
      sum += change(i) * change(j) * gram[shape.at(std::max(i, j), std::min(i, j))];
    }
  }
  return std::max(0.0, sum);
}

void rebase(const GramShape& shape, const Eigen::VectorXd& shift, const Eigen::VectorXd& change,
            std::vector<double>& gram) {
  const Eigen::Index size = shape.coefficients();
  Eigen::MatrixXd to = Eigen::MatrixXd::Identity(size + 1, size + 1);
  to.block(0, 1, 1, size - 1) = -shift.transpose();
  to.block(0, size, size, 1) = -change;
  const Eigen::MatrixXd result = to.transpose() * matrix_of(shape, gram.data()) * to;
  for (Eigen::Index i = 0; i <= size; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      gram[shape.at(i, j)] = result(i, j);
    }
  }
}

Eigen::VectorXd shifted_model(const Eigen::VectorXd& model, const Eigen::VectorXd& shift) {
  Eigen::VectorXd result = model;
  result(0) += model.tail(shift.size()).dot(shift);
  return result;
}

}  // namespace llmt
