/// \file
/// Data and options that constraints are tested on.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "llmt/fit.hpp"
#include "llmt/random.hpp"

namespace monotone_data {

using Eigen::MatrixXd;

/// Rises with x1 but for a dip, falls with x2 but for a wave, and both depend on x3 and x4.
inline MatrixXd nearly_monotone(const MatrixXd& x, double noise, std::uint64_t seed) {
  llmt::Random random(seed);
  MatrixXd y(x.rows(), 1);
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    const double third = std::isnan(x(i, 2)) ? 0.5 : x(i, 2);
    y(i, 0) = (2.0 + third) * std::tanh(2.0 * x(i, 0)) - 1.5 * std::exp(-20.0 * std::pow(x(i, 0) - 0.3, 2)) -
              x(i, 1) * (1.5 + std::sin(4.0 * x(i, 1))) + 2.0 * std::abs(third) + noise * random.normal();
  }
  return y;
}

/// Options of a fit without folds.
struct Case {
  const char* name;
  llmt::FitOptions options;
};

inline std::vector<Case> cases() {
  llmt::FitOptions base;
  base.max_leaves = 14;
  base.min_leaf_samples = 8;
  base.significance = 1.0;
  base.folds.count = 0;
  std::vector<Case> result = {{"crisp", base}};
  for (const double width : {0.5, 1.0, 4.0}) {
    for (const double ridge : {1e-6, 1e-2}) {
      llmt::FitOptions blend = base;
      blend.validity = llmt::ValidityChoice::blend;
      blend.expert.widths = {width};
      blend.expert.ridges = {ridge};
      result.push_back({"blend", blend});
    }
  }
  for (const llmt::Estimation estimation : {llmt::Estimation::as_grown, llmt::Estimation::local}) {
    llmt::FitOptions blend = base;
    blend.validity = llmt::ValidityChoice::blend;
    blend.expert.widths = {1.0};
    blend.expert.estimation = estimation;
    result.push_back({"blend, locally estimated", blend});
  }
  llmt::FitOptions jumps = result[1].options;
  jumps.expert.jumps = {0.1};
  result.push_back({"some jumps", jumps});
  llmt::FitOptions retis = base;
  retis.rule = llmt::GrowthRule::retis;
  retis.expert.shrinkages = {1.0};
  result.push_back({"retis", retis});
  llmt::FitOptions gaussian = base;
  gaussian.validity = llmt::ValidityChoice::gaussian;
  gaussian.expert.widths = {0.33};
  result.push_back({"gaussian", gaussian});
  llmt::FitOptions lolimot = base;
  lolimot.rule = llmt::GrowthRule::lolimot;
  for (const llmt::Estimation estimation :
       {llmt::Estimation::as_grown, llmt::Estimation::local, llmt::Estimation::joint}) {
    lolimot.expert.estimation = estimation;
    lolimot.expert.ridges = {1e-4};
    if (estimation != llmt::Estimation::joint) {
      lolimot.expert.ridges.clear();
    }
    result.push_back({"lolimot", lolimot});
  }
  return result;
}

}  // namespace monotone_data
