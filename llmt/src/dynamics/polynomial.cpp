#include "dynamics/polynomial.hpp"

#include <algorithm>
#include <cmath>

#include "base/decompositions.hpp"
#include "partition/smooth_clamp.hpp"

namespace llmt {
namespace {

void add_terms(Eigen::Index regressors, int degree, std::vector<int>& begun, std::vector<std::vector<int>>& terms) {
  if (std::ssize(begun) == degree) {
    terms.push_back(begun);
    return;
  }
  for (int j = begun.empty() ? 0 : begun.back(); j < regressors; ++j) {
    begun.push_back(j);
    add_terms(regressors, degree, begun, terms);
    begun.pop_back();
  }
}

}  // namespace

std::vector<std::vector<int>> all_terms(Eigen::Index regressors, int degree) {
  std::vector<std::vector<int>> terms;
  std::vector<int> begun;
  for (int d = 0; degree > 0 && d <= degree; ++d) add_terms(regressors, d, begun, terms);
  return terms;
}

double number_of_terms(Eigen::Index regressors, int degree) {
  if (degree == 0) return 0.0;
  double count = 1.0;
  for (int d = 1; d <= degree; ++d) count *= static_cast<double>(regressors + d) / d;
  return std::round(count);
}

void standardise(const Polynomial& polynomial, const double* x, double* z) {
  const Eigen::Index regressors = polynomial.centre.size();
  for (Eigen::Index j = 0; j < regressors; ++j) {
    const double held = polynomial.is_held ? smooth_clamp(x[j], polynomial.low(j), polynomial.high(j)) : x[j];
    z[j] = (x[j] - polynomial.centre(j)) / polynomial.scale(j);
    z[regressors + j] = (held - polynomial.centre(j)) / polynomial.scale(j);
  }
}

void products_at(const Polynomial& polynomial, const double* z, double* products) {
  const Eigen::Index regressors = polynomial.centre.size();
  for (const std::vector<int>& term : polynomial.terms) {
    const double* factors = term.size() > 1 ? z + regressors : z;
    double product = 1.0;
    for (const int j : term) product *= factors[j];
    *products++ = product;
  }
}

void add_polynomial_slopes(const Polynomial& polynomial, const double* x, const double* z,
                           Eigen::MatrixXd& by_regressor) {
  const double* factors = z + polynomial.centre.size();
  for (std::size_t k = 0; k < polynomial.terms.size(); ++k) {
    const std::vector<int>& term = polynomial.terms[k];
    for (std::size_t i = 0; i < term.size(); ++i) {
      const int j = term[i];
      double product = 1.0 / polynomial.scale(j);
      if (polynomial.is_held && term.size() > 1) {
        product *= smooth_clamp_derivative(x[j], polynomial.low(j), polynomial.high(j));
      }
      for (std::size_t other = 0; other < term.size(); ++other) {
        if (other != i) product *= factors[term[other]];
      }
      by_regressor.col(j) += product * polynomial.coefficients.col(static_cast<Eigen::Index>(k));
    }
  }
}

Polynomial fit_polynomial(const Eigen::MatrixXd& regressors, const Eigen::MatrixXd& outputs, int degree, double ridge) {
  const Eigen::Index rows = regressors.rows();
  Polynomial polynomial;
  polynomial.centre = regressors.colwise().mean().transpose();
  polynomial.scale.resize(regressors.cols());
  polynomial.low = regressors.colwise().minCoeff().transpose();
  polynomial.high = regressors.colwise().maxCoeff().transpose();
  for (Eigen::Index j = 0; j < regressors.cols(); ++j) {
    const double deviation = std::sqrt((regressors.col(j).array() - polynomial.centre(j)).square().mean());
    polynomial.scale(j) = deviation > 1e-12 * (std::abs(polynomial.centre(j)) + 1e-280) ? deviation : 1.0;
  }
  polynomial.terms = all_terms(regressors.cols(), degree);
  const Eigen::Index count = std::ssize(polynomial.terms);
  polynomial.coefficients = Eigen::MatrixXd::Zero(outputs.cols(), count);
  if (count == 0 || rows == 0) return polynomial;
  const Eigen::Index penalised = ridge > 0.0 ? count : 0;
  Eigen::MatrixXd design = Eigen::MatrixXd::Zero(rows + penalised, count);
  Eigen::VectorXd z(2 * regressors.cols());
  Eigen::VectorXd x(regressors.cols());
  Eigen::VectorXd products(count);
  for (Eigen::Index row = 0; row < rows; ++row) {
    x = regressors.row(row).transpose();
    standardise(polynomial, x.data(), z.data());
    products_at(polynomial, z.data(), products.data());
    design.row(row) = products.transpose();
  }
  for (Eigen::Index k = 0; k < penalised; ++k) {
    const bool is_linear = polynomial.terms[k].size() < 2;
    design(rows + k, k) = is_linear ? 0.0 : std::sqrt(ridge * static_cast<double>(rows));
  }
  Eigen::MatrixXd target = Eigen::MatrixXd::Zero(rows + penalised, outputs.cols());
  target.topRows(rows) = outputs;
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(design);
  polynomial.coefficients = qr.solve(target).transpose();
  return polynomial;
}

}  // namespace llmt
