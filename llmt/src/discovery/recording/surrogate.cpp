#include "discovery/recording/surrogate.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

namespace llmt::discovery {
namespace {

constexpr Eigen::Index most_with_squares = 8;

Eigen::MatrixXd ridge_fit(const Eigen::MatrixXd& features, const Eigen::MatrixXd& outputs) {
  // Enough to make the solution unique; the features are of order one.
  constexpr double ridge = 1e-10;
  Eigen::MatrixXd gram = features.transpose() * features;
  gram.diagonal().array() += ridge * static_cast<double>(features.rows());
  return gram.ldlt().solve(features.transpose() * outputs);
}

}  // namespace

Surrogate::Surrogate(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& simulated)
    : centre_(inputs.colwise().mean()),
      spread_((inputs.rowwise() - centre_).array().square().colwise().mean().sqrt()),
      low_(inputs.colwise().minCoeff()),
      high_(inputs.colwise().maxCoeff()),
      with_peaks_(inputs.cols(), false) {
  for (double& spread : spread_) spread = spread > 0.0 ? spread : 1.0;
  fit(inputs, simulated);
  constexpr double clearly = 0.8;
  for (Eigen::Index j = 0; j < inputs.cols() && described_.minCoeff() < well_described; ++j) {
    if (!changes_sign(j)) continue;
    const Surrogate without = *this;
    with_peaks_[j] = true;
    fit(inputs, simulated);
    if (1.0 - described_.minCoeff() > clearly * (1.0 - without.described_.minCoeff())) *this = without;
  }
}

void Surrogate::fit(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& simulated) {
  const Eigen::Index n = inputs.rows();
  constexpr Eigen::Index parts = 5;
  constexpr Eigen::Index rows_for_a_feature = 4;
  Eigen::MatrixXd all = features(inputs);
  if (n < rows_for_a_feature * all.cols()) {
    with_products_ = false;
    all = features(inputs);
  }
  Eigen::MatrixXd errors = simulated;
  for (Eigen::Index part = 0; part < parts; ++part) {
    std::vector<Eigen::Index> fitted;
    std::vector<Eigen::Index> left_out;
    // Stretches, not single rows: neighbours in time would tell of each other.
    for (Eigen::Index i = 0; i < n; ++i) (i * 4 * parts / n % parts == part ? left_out : fitted).push_back(i);
    if (left_out.empty()) continue;
    const Eigen::MatrixXd own = ridge_fit(all(fitted, Eigen::all), simulated(fitted, Eigen::all));
    errors(left_out, Eigen::all) -= all(left_out, Eigen::all) * own;
  }
  coefficients_ = ridge_fit(all, simulated);
  described_ = Eigen::VectorXd::Ones(simulated.cols());
  undescribed_ = errors.colwise().squaredNorm().transpose() / static_cast<double>(n);
  for (Eigen::Index o = 0; o < simulated.cols(); ++o) {
    const double total = (simulated.col(o).array() - simulated.col(o).mean()).square().sum();
    if (total > 0.0) described_(o) = 1.0 - errors.col(o).squaredNorm() / total;
  }
}

Eigen::MatrixXd Surrogate::features(const Eigen::MatrixXd& inputs, std::vector<Dry>* dry) const {
  const Eigen::Index n = inputs.rows();
  const Eigen::Index p = inputs.cols();
  std::vector<Eigen::ArrayXd> columns = {Eigen::ArrayXd::Ones(n)};
  const Eigen::MatrixXd z = (inputs.rowwise() - centre_).array().rowwise() / spread_.array();
  for (Eigen::Index j = 0; j < p; ++j) {
    const Eigen::ArrayXd x = z.col(j).array();
    columns.insert(columns.end(), {x, x.square(), x.cube()});
    const Eigen::ArrayXd own = inputs.col(j).array();
    columns.insert(columns.end(), {own.sin(), own.cos()});
    if (changes_sign(j)) {
      const Eigen::ArrayXd scaled = own / spread_(j);
      columns.insert(columns.end(), {scaled.abs(), scaled * scaled.abs()});
      constexpr int widths = 7;
      const int peaks = with_peaks_[j] ? widths : 0;
      if (dry) dry->push_back({std::ssize(columns), 1 + peaks});
      columns.push_back(own.sign());
      for (int k = 0; k < peaks; ++k) {
        columns.push_back(own.sign() * (-(scaled * std::ldexp(1.0, k)).square()).exp());
      }
    }
    for (Eigen::Index k = 0; k < j && with_products_; ++k) {
      const Eigen::ArrayXd other = z.col(k).array();
      columns.push_back(x * other);
      if (p <= most_with_squares) columns.insert(columns.end(), {x.square() * other, x * other.square()});
    }
  }
  Eigen::MatrixXd all(n, std::ssize(columns));
  for (std::size_t k = 0; k < columns.size(); ++k) all.col(k) = columns[k].matrix();
  return all;
}

Eigen::MatrixXd Surrogate::predict(const Eigen::MatrixXd& inputs) const { return features(inputs) * coefficients_; }

Eigen::MatrixXd Surrogate::jumps(const Eigen::MatrixXd& inputs) const {
  std::vector<Dry> dry;
  const Eigen::MatrixXd all = features(inputs, &dry);
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(inputs.rows(), coefficients_.cols());
  for (const Dry& of_input : dry) {
    const auto columns = Eigen::seqN(of_input.first, of_input.count);
    const Eigen::MatrixXd part = all(Eigen::all, columns) * coefficients_(columns, Eigen::all);
    for (Eigen::Index o = 0; o < part.cols(); ++o) {
      // What is smaller may stand for something that is not described.
      if (part.col(o).squaredNorm() > undescribed_(o) * static_cast<double>(inputs.rows())) sum.col(o) += part.col(o);
    }
  }
  return sum;
}

Eigen::MatrixXd Surrogate::derivative(const Eigen::MatrixXd& inputs, Eigen::Index column) const {
  constexpr double share = 1e-4;  // of the spread
  const double step = share * spread_(column);
  Eigen::MatrixXd moved = inputs;
  moved.col(column).array() += step;
  const Eigen::MatrixXd above = predict(moved);
  moved.col(column).array() -= 2.0 * step;
  return (above - predict(moved)) / (2.0 * step);
}

}  // namespace llmt::discovery
