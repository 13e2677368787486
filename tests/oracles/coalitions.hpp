// Shapley values by their definition.
#pragma once

#include <Eigen/Core>
#include <bit>
#include <cmath>

#include "llmt/boosted_model.hpp"

namespace oracle {

// From the values of all 2^n coalitions: phi_i = sum over S without i of |S|! (n - |S| - 1)! / n! (v(S + i) - v(S)).
inline Eigen::VectorXd shapley(const Eigen::VectorXd& v, int n) {
  const auto factorial = [](int k) { return std::tgamma(k + 1.0); };
  Eigen::VectorXd phi = Eigen::VectorXd::Zero(n);
  for (unsigned s = 0; s < (1U << n); ++s) {
    const int size = std::popcount(s);
    for (int i = 0; i < n; ++i) {
      if ((s >> i & 1U) != 0U) continue;
      phi(i) += factorial(size) * factorial(n - size - 1) / factorial(n) * (v(s | 1U << i) - v(s));
    }
  }
  return phi;
}

/// Contributions to the prediction of `x`, outputs x inputs, by predictions of rows whose inputs are mixed: for models
/// of few inputs.
inline Eigen::MatrixXd by_all_coalitions(const llmt::BoostedModel& model, const Eigen::VectorXd& x,
                                         const Eigen::MatrixXd& background) {
  const int n = static_cast<int>(model.num_inputs());
  Eigen::MatrixXd v = Eigen::MatrixXd::Zero(1 << n, model.num_outputs());
  for (unsigned s = 0; s < (1U << n); ++s) {
    Eigen::MatrixXd mixed = background;
    for (int i = 0; i < n; ++i) {
      if ((s >> i & 1U) != 0U) mixed.col(i).setConstant(x(i));
    }
    v.row(s) = model.predict(mixed, 1).colwise().mean();
  }
  Eigen::MatrixXd phi(model.num_outputs(), n);
  for (Eigen::Index o = 0; o < model.num_outputs(); ++o) phi.row(o) = shapley(v.col(o), n).transpose();
  return phi;
}

}  // namespace oracle
