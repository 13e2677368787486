#include "growth/m5/model.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

namespace llmt {
namespace {

// A column of which the ones before it leave less is collinear with them: the digits of a sum of squares.
constexpr double least_independence = 1e-10;

// What a sum of squares has of rounding.
constexpr double rounding_of_squares = 1e-15;

// Columns that are not collinear, in order, by a Cholesky factor of their correlations.
std::vector<Eigen::Index> independent_columns(const Eigen::MatrixXd& correlations) {
  const Eigen::Index count = correlations.rows();
  Eigen::MatrixXd factor = Eigen::MatrixXd::Zero(count, count);
  std::vector<Eigen::Index> kept;
  for (Eigen::Index i = 0; i < count; ++i) {
    double pivot = correlations(i, i);
    for (const Eigen::Index j : kept) {
      factor(i, j) = (correlations(i, j) - factor.row(i).head(j).dot(factor.row(j).head(j))) / factor(j, j);
      pivot -= factor(i, j) * factor(i, j);
    }
    if (pivot > least_independence) {
      factor(i, i) = std::sqrt(pivot);
      kept.push_back(i);
    }
  }
  return kept;
}

// The least-squares solution, and what dropping columns does to it, in columns of unit variance.
struct Solution {
  std::vector<Eigen::Index> columns;
  Eigen::MatrixXd inverse;  // of their correlations
  Eigen::VectorXd coefficients;
  double squares;  // mean of the squared residuals

  // The column whose loss costs least, and what: coefficient^2 / inverse_jj.
  Eigen::Index cheapest(double& cost) const {
    Eigen::Index at = 0;
    cost = coefficients.cwiseAbs2().cwiseQuotient(inverse.diagonal()).minCoeff(&at);
    return at;
  }

  void drop(Eigen::Index at, double cost) {
    const Eigen::Index last = std::ssize(columns) - 1;
    const Eigen::VectorXd of_column = inverse.col(at);
    coefficients -= of_column * (coefficients(at) / of_column(at));
    inverse -= of_column * of_column.transpose() / of_column(at);
    columns.erase(columns.begin() + at);
    std::vector<Eigen::Index> left;
    for (Eigen::Index k = 0; k <= last; ++k) {
      if (k != at) {
        left.push_back(k);
      }
    }
    coefficients = Eigen::VectorXd(coefficients(left));
    inverse = Eigen::MatrixXd(inverse(left, left));
    squares += cost;
  }
};

}  // namespace

double adjusted_error(double error, double n, double v) {
  return n > v ? error * (n + 2.0 * v) / (n - v) : 10.0 * error;
}

FewInputsModel fit_few_inputs(const RowMajor& x, const Eigen::VectorXd& y, const Eigen::VectorXd& weights) {
  const double total = weights.sum();
  const double rows = static_cast<double>(x.rows());
  const Eigen::RowVectorXd mean = weights.transpose() * x / total;
  const double y_mean = weights.dot(y) / total;
  const RowMajor centred = x.rowwise() - mean;
  const Eigen::VectorXd y_centred = y.array() - y_mean;
  std::vector<Eigen::Index> varying;
  std::vector<double> largest;  // deviation of each
  for (Eigen::Index k = 0; k < x.cols(); ++k) {
    if (x.col(k).minCoeff() < x.col(k).maxCoeff()) {
      varying.push_back(k);
      largest.push_back(centred.col(k).cwiseAbs().maxCoeff());
    }
  }
  // Dividing by the largest deviation keeps the squares of very small and very large columns in range.
  const Eigen::Map<const Eigen::VectorXd> magnitude(largest.data(), std::ssize(largest));
  RowMajor scaled = centred(Eigen::all, varying) * magnitude.cwiseInverse().asDiagonal();
  const Eigen::RowVectorXd deviation = (weights.transpose() * scaled.cwiseAbs2() / total).cwiseSqrt();
  scaled *= deviation.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd correlations = scaled.transpose() * weights.asDiagonal() * scaled / total;
  const Eigen::VectorXd products = scaled.transpose() * weights.cwiseProduct(y_centred) / total;
  const double variance = weights.dot(y_centred.cwiseAbs2()) / total;

  Solution solution;
  solution.columns = independent_columns(correlations);
  if (!solution.columns.empty()) {
    const Eigen::MatrixXd chosen = correlations(solution.columns, solution.columns);
    solution.inverse = chosen.llt().solve(Eigen::MatrixXd::Identity(chosen.rows(), chosen.cols()));
  }
  solution.coefficients = solution.inverse * products(solution.columns);
  const double floor = rounding_of_squares * variance;
  solution.squares = std::max(floor, variance - solution.coefficients.dot(products(solution.columns)));
  while (!solution.columns.empty()) {
    const double coefficients = static_cast<double>(solution.columns.size()) + 1.0;
    double cost = 0.0;
    const Eigen::Index cheapest = solution.cheapest(cost);
    const double with = adjusted_error(std::sqrt(solution.squares), total, coefficients);
    const double without = adjusted_error(std::sqrt(solution.squares + cost), total, coefficients - 1.0);
    if (std::min(rows, total) > coefficients && without > with) break;
    solution.drop(cheapest, cost);
  }

  FewInputsModel model;
  model.slope = Eigen::VectorXd::Zero(x.cols());
  model.coefficients = static_cast<int>(solution.columns.size()) + 1;
  model.residuals = y_centred;
  const RowMajor regressors = scaled(Eigen::all, solution.columns);
  // The second pass adds what rounding of the sums left.
  Eigen::VectorXd coefficients = Eigen::VectorXd::Zero(regressors.cols());
  for (int pass = 0; pass < 2 && regressors.cols() > 0; ++pass) {
    const Eigen::VectorXd change =
        solution.inverse * (regressors.transpose() * weights.cwiseProduct(model.residuals)) / total;
    coefficients += change;
    model.residuals -= regressors * change;
  }
  model.value = y_mean;
  for (std::size_t k = 0; k < solution.columns.size(); ++k) {
    const Eigen::Index at = solution.columns[k];
    const Eigen::Index column = varying[at];
    model.slope(column) = coefficients(k) / (deviation(at) * magnitude(at));
    model.value -= model.slope(column) * mean(column);
  }
  model.rms = std::sqrt(weights.dot(model.residuals.cwiseAbs2()) / total);
  return model;
}

}  // namespace llmt
