// Options and references for the tests of local models.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "llmt/fit.hpp"
#include "oracles/thrown.hpp"

namespace local_models {

using oracle::thrown;

using llmt::LocalTerms;
using llmt::SparseChoice;
using llmt::ValidityChoice;

inline constexpr double missing = std::numeric_limits<double>::quiet_NaN();
inline const std::vector<ValidityChoice> validities = {ValidityChoice::crisp, ValidityChoice::blend,
                                                       ValidityChoice::gaussian};

// One candidate, no choice.
inline llmt::FitOptions only(ValidityChoice validity, Eigen::Index max_leaves, LocalTerms terms,
                             SparseChoice sparse = SparseChoice::never) {
  llmt::FitOptions options;
  options.significance = llmt::every_split;
  options.max_leaves = max_leaves;
  options.terms = terms;
  options.sparse = sparse;
  options.validity = validity;
  options.expert.widths = {validity == ValidityChoice::gaussian ? 1.0 / 3.0 : 1.0};
  options.expert.ridges = {1e-3};
  options.expert.shrinkages = {0.0};
  options.folds.count = 0;
  return options;
}

// Regressors as they stand in Leaf: products of deviations from the means of the inputs.
inline Eigen::MatrixXd regressors_of(const llmt::Model& model, const Eigen::MatrixXd& x) {
  Eigen::MatrixXd result(x.rows(), std::ssize(model.regressors()));
  for (std::size_t k = 0; k < model.regressors().size(); ++k) {
    const llmt::Regressor& regressor = model.regressors()[k];
    const auto deviation = [&](int input) { return x.col(input).array() - model.inputs()[input].centre; };
    auto column = result.col(k);
    if (regressor.second_input < 0) {
      column = x.col(regressor.input);
    } else {
      column = deviation(regressor.input) * deviation(regressor.second_input);
    }
  }
  return result;
}

inline Eigen::VectorXd quadratic_function(const Eigen::MatrixXd& x) {
  const auto a = x.col(0).array();
  const auto b = x.col(1).array();
  const auto c = x.col(2).array();
  return 3.0 + a - 2.0 * b + 0.7 * a * b - 1.5 * c * c + 0.4 * a * c + 0.2 * a * a;
}

inline Eigen::MatrixXd with_constant(const Eigen::MatrixXd& x) {
  Eigen::MatrixXd result(x.rows(), x.cols() + 1);
  result << Eigen::VectorXd::Ones(x.rows()), x;
  return result;
}

}  // namespace local_models
