/// \file
/// The options of llmt::fit that several benchmarks set, each under the name of what it stands for.
#pragma once

#include "llmt/fit.hpp"

namespace bench {

/// Linear least squares: one leaf, nothing to choose.
inline llmt::FitOptions least_squares(llmt::FitOptions options = {}) {
  options.max_leaves = 1;
  options.folds.count = 0;
  return options;
}

/// A tree without blends.
inline llmt::FitOptions crisp(llmt::FitOptions options = {}) {
  options.validity = llmt::ValidityChoice::crisp;
  return options;
}

/// A tree with this number of leaves, whether its splits pass the tests of growth or not, and no choice by held-out
/// error.
inline llmt::FitOptions with_leaves(Eigen::Index leaves, llmt::FitOptions options = {}) {
  options.max_leaves = leaves;
  options.significance = llmt::every_split;
  options.folds.count = 0;
  return options;
}

inline llmt::FitOptions with_rule(llmt::GrowthRule rule, llmt::FitOptions options = {}) {
  options.rule = rule;
  return options;
}

}  // namespace bench
