/// \file
/// How much worse a model gets without what an input says, on rows that it had not seen.
///
///     const llmt::PermutationImportance found = llmt::permutation_importance(
///         result.intervals.models(), inputs, outputs, result.summary.held_out);
///     const double rise = found.increase(0, 2);  // of the RMSE of the first output, without the third input
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/model.hpp"
#include "llmt/progress.hpp"

namespace llmt {

struct PermutationOptions {
  int repeats = 5;                ///< permutations of each input in each fold; 1 or more
  Eigen::Index most_rows = 2000;  ///< held-out rows of all folds that are looked at, evenly spaced; 10 or more
  std::uint64_t seed = 1;
  int max_threads = 0;  ///< 0: all
};

struct PermutationImportance {
  Eigen::Index rows = 0;           ///< held-out rows that were looked at
  Eigen::VectorXd rmse;            ///< on them, one an output
  Eigen::MatrixXd increase;        ///< of the RMSE, outputs x inputs; below 0 by chance
  Eigen::MatrixXd standard_error;  ///< of the increase
};

/// Permutation importance (Breiman 2001; Fisher, Rudin & Dominici 2019) on held-out rows. With f_k(i) the model that
/// was fitted without row i, x_i^p the row with the value of input j of another held-out row of its fold, and
///   D_i = mean over repeats of (y_i - f_k(i)(x_i^p))^2 - (y_i - f_k(i)(x_i))^2,
/// the increase is sqrt(MSE + mean D) - sqrt(MSE), and its standard error, to first order,
///   s(D) / (2 sqrt(n (MSE + mean D))),
/// s(D) the standard deviation of D_i over the n rows. It says what the rows say beyond chance, not how another fit
/// would differ. Inputs that move together stand in for each other: each looks less important than both are.
///
/// `models`, `held_out`: of the folds, as Intervals::models() and FitSummary::held_out. `weights`: of the rows in the
/// means; empty: all 1. Same bytes at any number of threads. Throws std::invalid_argument if the numbers of folds,
/// rows, inputs or outputs differ, no row is held out, or an option is out of range, and as Model::predict().
PermutationImportance permutation_importance(const std::vector<Model>& models,
                                             const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                                             const Eigen::Ref<const Eigen::MatrixXd>& outputs,
                                             const std::vector<std::vector<Eigen::Index>>& held_out,
                                             const Eigen::VectorXd& weights = {},
                                             const PermutationOptions& options = {}, const Progress& progress = {});

}  // namespace llmt
