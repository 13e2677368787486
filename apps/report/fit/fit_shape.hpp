/// \file
/// Charts of a fit that say what the model does with its inputs.
#pragma once

#include <vector>

#include "report/fit/of_fit.hpp"

namespace llmt::report {

/// The inputs with a share above 0, the largest first.
std::vector<int> by_importance(const Eigen::VectorXd& shares);

Chart importance_chart(const Model& model, const Eigen::VectorXd& shares, const std::vector<int>& order);

/// The prediction along one input, the others at their means; dashed, the readable tree.
Chart slice(const Fitted& fitted, Eigen::Index output, int input);

/// What each input added to the highest prediction.
Chart waterfall(const Fitted& fitted, Eigen::Index output);

}  // namespace llmt::report
