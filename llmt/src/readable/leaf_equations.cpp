#include "readable/leaf_equations.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "readable/decimal.hpp"

namespace llmt {
namespace {

// Keeps the factor of nearly collinear columns regular; a part of their sums of squares.
constexpr double least_diagonal = 1e-12;

// Whether a term that entered after the i-th one, and has a slope, asks for it.
bool is_needed(const Equation& equation, Eigen::Index output, Eigen::Index i, const std::vector<Parents>& parents) {
  for (Eigen::Index k = i + 1; !parents.empty() && k < std::ssize(equation.terms); ++k) {
    const auto& of_term = parents[equation.terms[k]];
    if (equation.slope(output, k) != 0.0 && std::ranges::find(of_term, equation.terms[i]) != of_term.end()) return true;
  }
  return false;
}

}  // namespace

Equation rounded_equation(const LocalSums& sums, const SelectionPath& path, Eigen::Index count, const Origin& origin,
                          const Grains& grains, const std::vector<Parents>& parents) {
  const double weight = sums.gram(0, 0);
  Equation equation{.terms = {path.regressors.begin(), path.regressors.begin() + count},
                    .intercept = origin.outputs + sums.products.row(0).transpose() / weight,
                    .slope = Eigen::MatrixXd::Zero(sums.products.cols(), count)};
  Eigen::VectorXd mean(count);
  Eigen::MatrixXd matrix(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    mean(i) = sums.gram(equation.terms[i] + 1, 0) / weight;
    for (Eigen::Index j = 0; j <= i; ++j) {
      matrix(i, j) = sums.gram(equation.terms[i] + 1, equation.terms[j] + 1) - weight * mean(i) * mean(j);
    }
    matrix(i, i) *= 1.0 + least_diagonal;
  }
  // The columns in units of their length.
  const Eigen::VectorXd length = matrix.diagonal().cwiseSqrt();
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) matrix(i, j) /= length(i) * length(j);
  }
  // One slope after the other: with the factor of the matrix, what the free ones are given the rounded ones is what
  // back substitution leaves.
  const Eigen::MatrixXd lower = Eigen::LLT<Eigen::MatrixXd>(matrix).matrixL();
  for (Eigen::Index o = 0; o < equation.slope.rows(); ++o) {
    Eigen::VectorXd right(count);
    for (Eigen::Index i = 0; i < count; ++i) {
      right(i) = (sums.products(equation.terms[i] + 1, o) - mean(i) * sums.products(0, o)) / length(i);
    }
    right = lower.triangularView<Eigen::Lower>().solve(right);
    for (Eigen::Index i = count - 1; i >= 0; --i) {
      const double rest =
          lower.col(i)
              .tail(count - i - 1)
              .dot(equation.slope.row(o).tail(count - i - 1).transpose().cwiseProduct(length.tail(count - i - 1)));
      const double free = (right(i) - rest) / lower(i, i) / length(i);
      equation.slope(o, i) = rounded(free, grains.slopes[o][equation.terms[i]]);
      if (equation.slope(o, i) == 0.0 && free != 0.0 && is_needed(equation, o, i, parents))
        equation.slope(o, i) = rounded(free, exponent_below(std::abs(free)));
      if (!grains.signs.empty() && grains.signs[equation.terms[i]] * equation.slope(o, i) < 0.0)
        equation.slope(o, i) = 0.0;
    }
    double intercept = equation.intercept(o);
    for (Eigen::Index i = 0; i < count; ++i) {
      intercept -= equation.slope(o, i) * (mean(i) + origin.terms(equation.terms[i]));
    }
    equation.intercept(o) = rounded(intercept, grains.intercept[o]);
  }
  return equation;
}

}  // namespace llmt
