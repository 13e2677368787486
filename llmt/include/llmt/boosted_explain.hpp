/// \file
/// What a prediction of a boosted model is made of: Shapley values of the inputs, importance, partial dependence.
///
///     const llmt::BoostedModel boosted = llmt::fit_boosted({inputs, outputs}).model;
///     const llmt::Attribution why = llmt::attribute(boosted, inputs.row(0).transpose(), inputs.topRows(100));
///     const double by_first_input = why.contributions(0, 0);  // rows sum to prediction - reference
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/boosted_model.hpp"
#include "llmt/explain.hpp"

namespace llmt {

/// Contributions of the inputs to the predictions of several rows.
struct Attributions {
  Eigen::MatrixXd predictions;                 ///< rows x outputs, in the outputs' units
  Eigen::VectorXd reference;                   ///< of each output, the mean prediction of the background
  std::vector<Eigen::MatrixXd> contributions;  ///< of each output rows x inputs; rows sum to prediction - reference
};

/// The Shapley values (Shapley 1953) of the inputs in the game
///   v(S) = mean over the rows b of the background of F(x_S, b_rest),
/// F the prediction where the inputs in S have the values of the row x and the others those of b: "interventional" SHAP
/// values (Strumbelj & Kononenko 2014; for trees with constant leaves Lundberg et al. 2020). They add up to
/// F(x) - mean of F(b) but for rounding, an input that the model does not use gets nothing, and those of a sum are the
/// sums of those of its trees. Slopes, limits of leaves, soft splits, sums of inputs and missing values are in it as
/// in BoostedModel::predict().
///
/// Exact: each tree is walked once for x and b together, and what comes to its leaves is integrated as polynomials
/// (docs/algorithms/explanation.md). Where sums of inputs, limits of leaves or a smallest_share do not allow that,
/// inputs are tried one by one, at most Limit::sum_trials times in a tree. A sum with features of more than two inputs
/// that uses at most ten inputs is predicted for all coalitions S instead. The time grows with the background.
///
/// Throws std::invalid_argument if a number of columns differs, a value is infinite, there is no background, or a tree
/// needs more trials. Same bytes at any number of threads (0: all). Reports to `progress` after each row of the inputs
/// and within the rows.
Attributions attribute_rows(const BoostedModel& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                            const Eigen::Ref<const Eigen::MatrixXd>& background, int max_threads = 0,
                            const Progress& progress = {});

/// attribute() for one row.
Attribution attribute(const BoostedModel& model, const Eigen::Ref<const Eigen::VectorXd>& point,
                      const Eigen::Ref<const Eigen::MatrixXd>& background);

/// Rows evenly spaced over a table, at most `most`, as a background. All that reports and programs explain is against
/// these.
Eigen::MatrixXd background_of(const Eigen::Ref<const Eigen::MatrixXd>& inputs, Eigen::Index most = 100);

/// importance() of a sum looks at no more than this many rows, against a background of no more than so many.
inline constexpr Eigen::Index boosted_importance_rows = 200;
inline constexpr Eigen::Index boosted_importance_background = 20;

/// How much each input moves the predictions over a table, outputs x inputs: the mean of |contribution| over rows of
/// it, against a background of others, both evenly spaced, divided by its sum over the inputs. Rows sum to 1, or are 0
/// where the prediction does not change. Throws and reports as attribute_rows().
Eigen::MatrixXd importance(const BoostedModel& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                           int max_threads = 0, const Progress& progress = {});

/// Partial dependence (Friedman 2001): the mean prediction over the rows of a table in which one input has the same
/// value in all of them, values x outputs. Throws std::invalid_argument as BoostedModel::predict(), for a table without
/// rows and if there is no such input. Reports to `progress` after each value.
Eigen::MatrixXd partial_dependence(const BoostedModel& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                                   Eigen::Index input, const Eigen::Ref<const Eigen::VectorXd>& values,
                                   int max_threads = 0, const Progress& progress = {});

}  // namespace llmt
