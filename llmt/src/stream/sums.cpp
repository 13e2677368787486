#include "stream/sums.hpp"

#include <algorithm>
#include <cmath>

#include "base/simd.hpp"

namespace llmt {
namespace {

LLMT_FOR_EACH_INSTRUCTION_SET
void multiply(const double* features, Eigen::Index columns, double* products) {
  for (Eigen::Index i = 0; i < columns; ++i) {
    double* out = products + GramShape::row_begin(i);
    for (Eigen::Index j = 0; j <= i; j += lanes) {
      *reinterpret_cast<Lanes*>(out + j) = features[i] * *reinterpret_cast<const Lanes*>(features + j);
    }
  }
}

LLMT_FOR_EACH_INSTRUCTION_SET
void add_all(const double* from, Eigen::Index size, double* to) {
  for (Eigen::Index k = 0; k < size; k += lanes) {
    *reinterpret_cast<Lanes*>(to + k) += *reinterpret_cast<const Lanes*>(from + k);
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
    const double held = deviation == deviation ? deviation : 0.0;
    residual -= basis.base(k) * held;
    features_[k] = root * held;
  }
  features_[coefficients] = root * residual;
  multiply(features_.data(), shape_.columns(), products_.data());
}

void RowProducts::add_to(double* gram) const { add_all(products_.data(), shape_.size(), gram); }

Eigen::MatrixXd matrix_of(const GramShape& shape, const double* gram) {
  Eigen::MatrixXd matrix(shape.columns(), shape.columns());
  for (Eigen::Index i = 0; i < shape.columns(); ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      matrix(i, j) = matrix(j, i) = gram[shape.at(i, j)];
    }
  }
  return matrix;
}

Eigen::VectorXd solve(const GramShape& shape, const double* gram, double shrinkage, int& rank) {
  const Eigen::Index size = shape.coefficients();
  Eigen::VectorXd change = Eigen::VectorXd::Zero(size);
  rank = 0;
  const double total = gram[0];
  if (!(total > 0.0)) return change;
  rank = 1;
  // The covariance of the regressors and the residual, in columns of unit variance.
  Eigen::VectorXd mean(size);
  for (Eigen::Index k = 0; k < size; ++k) {
    mean(k) = gram[shape.at(k, 0)] / total;
  }
  const double residual_mean = gram[shape.at(size, 0)] / total;
  Eigen::VectorXd scale = Eigen::VectorXd::Zero(size);
  for (Eigen::Index k = 1; k < size; ++k) {
    const double square = gram[shape.at(k, k)];
    const double variance = square - total * mean(k) * mean(k);
    scale(k) = variance > pivot_tolerance * square ? std::sqrt(variance) : 0.0;
  }
  // L D L' of the correlation matrix; columns that follow from those before are left out.
  Eigen::MatrixXd factor = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
  std::vector<Eigen::Index> kept;
  const double hold = shrinkage / total;
  for (Eigen::Index k = 1; k < size; ++k) {
    if (!(scale(k) > 0.0)) continue;
    double pivot = 1.0 + hold;
    for (const Eigen::Index j : kept) {
      double sum = (gram[shape.at(k, j)] - total * mean(k) * mean(j)) / (scale(k) * scale(j));
      for (const Eigen::Index m : kept) {
        if (m >= j) break;
        sum -= factor(k, m) * factor(j, m);
      }
      factor(k, j) = sum / factor(j, j);
      pivot -= factor(k, j) * factor(k, j);
    }
    if (!(pivot > 1e-10)) continue;
    factor(k, k) = std::sqrt(pivot);
    double sum = (gram[shape.at(size, k)] - total * mean(k) * residual_mean) / scale(k);
    for (const Eigen::Index j : kept) {
      sum -= factor(k, j) * right(j);
    }
    right(k) = sum / factor(k, k);
    kept.push_back(k);
  }
  rank += static_cast<int>(kept.size());
  for (Eigen::Index at = std::ssize(kept) - 1; at >= 0; --at) {
    const Eigen::Index k = kept[at];
    double sum = right(k);
    for (Eigen::Index later = at + 1; later < std::ssize(kept); ++later) {
      const Eigen::Index m = kept[later];
      sum -= factor(m, k) * change(m);
    }
    change(k) = sum / factor(k, k);
  }
  change(0) = residual_mean;
  for (const Eigen::Index k : kept) {
    change(k) /= scale(k);
    change(0) -= change(k) * mean(k);
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
