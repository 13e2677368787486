/// \file
/// Shapley values by their definition, from all coalitions of few inputs.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/boosted_model.hpp"
#include "llmt/progress.hpp"

namespace llmt {

/// Of the inputs that a model uses, the largest number of which all coalitions are asked for.
inline constexpr int most_in_coalitions = 10;

/// The Shapley values of the inputs in v(S) = mean over the columns b of `background` of F(x_S, b_rest), F the first
/// output: phi_i = sum over S without i of |S|! (n - |S| - 1)! / n! (v(S + i) - v(S)). `used`: the n inputs that F
/// depends on, at most most_in_coalitions; the others get 0. `work`: is asked now and then whether to go on.
Eigen::VectorXd shapley_values(const BoostedModel& model, const std::vector<int>& used, const Eigen::VectorXd& x,
                               const Eigen::MatrixXd& background, Work& work);

}  // namespace llmt
