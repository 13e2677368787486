/// \file
/// The linear model that a sum of trees may start from.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "boosted/binned_rows.hpp"

namespace llmt {

/// The slopes of all features by ridge, slopes = (Z'W Z + p I)^-1 Z'W y with centred Z and y. Of 15 penalties p, from
/// 1e-5 to 100 of the rows' weight, the one with the smallest leave-one-out error is taken. Each slope is a tree of one
/// leaf, held to its values in the rows `train`, widened by a tenth. There is no constant: boosting begins with one.
std::vector<BoostedTree> linear_start(const BinnedRows& rows, const Eigen::VectorXd& output,
                                      const std::vector<int>& train);

/// The sum of trees in each row of the fit.
Eigen::VectorXd values_of(const std::vector<BoostedTree>& trees, const BinnedRows& rows);

}  // namespace llmt
