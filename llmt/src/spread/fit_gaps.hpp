/// \file
/// The gaps of a table of training rows.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/gaps.hpp"

namespace llmt {

/// The gaps of rows in the given columns, which are numbers; the largest first. "Gaps" of docs/algorithms/intervals.md
/// has the rule.
std::vector<Gap> fit_gaps(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const std::vector<int>& columns);

}  // namespace llmt
