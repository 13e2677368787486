/// \file
/// Charts of a fit that say what the model does with its inputs.
#pragma once

#include <optional>
#include <vector>

#include "llmt/permutation_importance.hpp"
#include "report/fit/of_fit.hpp"

namespace llmt::report {

/// What the rows that were held out say of the inputs; empty where none was. `weights`: of the rows; empty: all 1.
std::optional<PermutationImportance> held_out_importance(const FitResult& result, const Eigen::MatrixXd& inputs,
                                                         const Eigen::MatrixXd& outputs, const Eigen::VectorXd& weights,
                                                         int max_threads);

/// By how much the error grows without each input, with two standard errors.
Chart increase_chart(const Model& model, const PermutationImportance& found, Eigen::Index output);

/// The inputs with a share above 0, the largest first.
std::vector<int> by_importance(const Eigen::VectorXd& shares);

Chart importance_chart(const Model& model, const Eigen::VectorXd& shares, const std::vector<int>& order);

/// Partial dependence (Friedman 2001): the mean prediction over the rows along one input, and thin lines of single
/// rows; dashed, that of the readable tree.
Chart slice(const Fitted& fitted, Eigen::Index output, int input);

/// Gives slices one axis of predictions, and below a mark for each of the rows. `inputs`: of each slice.
void on_one_axis(const Fitted& fitted, const std::vector<int>& inputs, std::vector<Chart>& slices);

/// What each input added to the highest prediction.
Chart waterfall(const Fitted& fitted, Eigen::Index output);

}  // namespace llmt::report
