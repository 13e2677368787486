// What tests of fits share: a table, and options that keep the tree as it grew.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <utility>
#include <vector>

#include "llmt/fit.hpp"

namespace oracle {

inline constexpr double missing = std::numeric_limits<double>::quiet_NaN();

/// Inputs and outputs.
struct Sample {
  Eigen::MatrixXd x;
  Eigen::MatrixXd y;
};

/// Crisp, without cross-validation.
inline llmt::FitOptions as_grown(llmt::FitOptions options = {}) {
  options.validity = llmt::ValidityChoice::crisp;
  options.folds.count = 0;
  return options;
}

inline const std::vector<llmt::Node>& nodes(const llmt::FitResult& result, std::size_t partition = 0) {
  return result.model.partitions()[partition].nodes;
}

}  // namespace oracle
