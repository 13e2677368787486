/// \file
/// Products of two numbers as columns of the local models.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "data/table.hpp"
#include "llmt/options.hpp"
#include "llmt/partition.hpp"

namespace llmt {

/// Largest number d of numeric regression inputs of quadratic local models. They have (d + 1) (d + 2) / 2 coefficients,
/// 105 for d = 13, and growth costs the square of that.
inline constexpr Eigen::Index most_inputs_of_products = 13;

/// Numeric regression inputs of a table.
std::vector<int> numeric_regression_inputs(const Table& table);

/// Number of numeric regression inputs that a fit of `inputs` columns, some of them categorical, has with these
/// options.
Eigen::Index count_numeric_inputs(Eigen::Index inputs, const std::vector<int>& categorical, const FitOptions& options);

/// All pairs of numeric regression inputs, i <= j, that say something of their own: none of an input that never varies,
/// no square of one that takes two values.
std::vector<std::pair<int, int>> products_of(const Table& table);

}  // namespace llmt
