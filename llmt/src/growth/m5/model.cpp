#include "growth/m5/model.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

#include "base/count.hpp"

namespace llmt {
namespace {

// A column is collinear with the columns before it if they leave less than this part of its sum of squares. Sums of
// squares have about 16 digits.
constexpr double least_independence = 1e-10;

// Relative rounding of a sum of squares.
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

  // The column whose loss raises the mean squared residual least, by `cost` = coefficient^2 / inverse_jj.
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

// The columns that vary, about their means and in units of their deviations, and the products that the fit needs. All
// means are weighted.
struct Standardised {
  Eigen::RowVectorXd mean;            // of all columns
  std::vector<Eigen::Index> varying;  // columns that are not constant; what follows is of these
  RowMajor scaled;                    // rows x varying columns
  Eigen::VectorXd deviation;          // of each column: `scaled` times this is the column about its mean
  Eigen::MatrixXd correlations;
  Eigen::VectorXd products;  // mean of column times y
  double y_mean = 0.0;
  Eigen::VectorXd y;  // about its mean
  double variance = 0.0;
};

Standardised standardise(const RowMajor& x, const Eigen::VectorXd& y, const Eigen::VectorXd& weights) {
  const double total = weights.sum();
  Standardised result;
  result.mean = weights.transpose() * x / total;
  result.y_mean = weights.dot(y) / total;
  result.y = y.array() - result.y_mean;
  const RowMajor centred = x.rowwise() - result.mean;
  std::vector<double> largest;  // deviation of each column
  for (Eigen::Index k = 0; k < x.cols(); ++k) {
    if (x.col(k).minCoeff() < x.col(k).maxCoeff()) {
      result.varying.push_back(k);
      largest.push_back(centred.col(k).cwiseAbs().maxCoeff());
    }
  }
  // Dividing by the largest deviation keeps the squares of very small and very large columns in range.
  const Eigen::Map<const Eigen::VectorXd> magnitude(largest.data(), std::ssize(largest));
  RowMajor& scaled = result.scaled;
  scaled = centred(Eigen::all, result.varying) * magnitude.cwiseInverse().asDiagonal();
  const Eigen::RowVectorXd deviation = (weights.transpose() * scaled.cwiseAbs2() / total).cwiseSqrt();
  scaled *= deviation.cwiseInverse().asDiagonal();
  result.deviation = deviation.transpose().cwiseProduct(magnitude);
  result.correlations = scaled.transpose() * weights.asDiagonal() * scaled / total;
  result.products = scaled.transpose() * weights.cwiseProduct(result.y) / total;
  result.variance = weights.dot(result.y.cwiseAbs2()) / total;
  return result;
}

// Least squares on all columns that are not collinear.
Solution solve(const Standardised& data) {
  Solution solution;
  solution.columns = independent_columns(data.correlations);
  if (!solution.columns.empty()) {
    const Eigen::MatrixXd chosen = data.correlations(solution.columns, solution.columns);
    solution.inverse = chosen.llt().solve(Eigen::MatrixXd::Identity(chosen.rows(), chosen.cols()));
  }
  solution.coefficients = solution.inverse * data.products(solution.columns);
  const double explained = solution.coefficients.dot(data.products(solution.columns));
  solution.squares = std::max(rounding_of_squares * data.variance, data.variance - explained);
  return solution;
}

// Drops columns as long as the adjusted error (docs/algorithms/m5.md, Q.2) does not rise, and until there are more rows
// than coefficients. `total`: sum of the weights.
void drop_columns(double rows, double total, Solution& solution) {
  while (!solution.columns.empty()) {
    const double coefficients = static_cast<double>(solution.columns.size()) + 1.0;
    double cost = 0.0;
    const Eigen::Index cheapest = solution.cheapest(cost);
    const double with = adjusted_error(std::sqrt(solution.squares), total, coefficients);
    const double without = adjusted_error(std::sqrt(solution.squares + cost), total, coefficients - 1.0);
    if (std::min(rows, total) > coefficients && without > with) return;
    solution.drop(cheapest, cost);
  }
}

}  // namespace

double adjusted_error(double error, double n, double v) {
  return n > v ? error * (n + 2.0 * v) / (n - v) : 10.0 * error;
}

FewInputsModel fit_few_inputs(const RowMajor& x, const Eigen::VectorXd& y, const Eigen::VectorXd& weights) {
  const double total = weights.sum();
  const Standardised data = standardise(x, y, weights);
  Solution solution = solve(data);
  drop_columns(static_cast<double>(x.rows()), total, solution);

  FewInputsModel model;
  model.slope = Eigen::VectorXd::Zero(x.cols());
  model.coefficients = count_of(solution.columns) + 1;
  model.residuals = data.y;
  const RowMajor regressors = data.scaled(Eigen::all, solution.columns);
  // The second pass adds what rounding of the sums left.
  Eigen::VectorXd coefficients = Eigen::VectorXd::Zero(regressors.cols());
  for (int pass = 0; pass < 2 && regressors.cols() > 0; ++pass) {
    const Eigen::VectorXd change =
        solution.inverse * (regressors.transpose() * weights.cwiseProduct(model.residuals)) / total;
    coefficients += change;
    model.residuals -= regressors * change;
  }
  model.value = data.y_mean;
  for (std::size_t k = 0; k < solution.columns.size(); ++k) {
    const Eigen::Index at = solution.columns[k];
    const Eigen::Index column = data.varying[at];
    model.slope(column) = coefficients(k) / data.deviation(at);
    model.value -= model.slope(column) * data.mean(column);
  }
  model.rms = std::sqrt(weights.dot(model.residuals.cwiseAbs2()) / total);
  return model;
}

}  // namespace llmt
