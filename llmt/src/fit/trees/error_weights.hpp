/// \file
/// The outputs of the partitions of a fit, and what their errors count.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "data/table.hpp"

namespace llmt {

/// The outputs that each partition serves: all, or one each.
std::vector<std::vector<int>> output_groups(Eigen::Index outputs, bool shared);

/// Mean squared deviation from the mean.
double variance_of(const Eigen::Ref<const Eigen::VectorXd>& values);

/// Weights of the outputs' squared errors: 1 for a single one; else 1 / variance, so that outputs of any scale count
/// alike.
Eigen::VectorXd error_weights(const Table& table, const std::vector<int>& served);

}  // namespace llmt
