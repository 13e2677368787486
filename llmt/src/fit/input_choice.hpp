/// \file
/// Which inputs a partition uses: backward elimination, docs/algorithms/input-choice.md.
#pragma once

#include <vector>

#include "data/fold_rows.hpp"
#include "fit/defaults.hpp"
#include "llmt/options.hpp"
#include "llmt/progress.hpp"
#include "llmt/summary.hpp"

namespace llmt {

/// The inputs of a partition: of the model of all rows, and of each fold's, which has as many.
struct ChosenInputs {
  std::vector<int> of_all;  ///< ascending
  std::vector<std::vector<int>> of_folds;
  std::vector<InputStep> steps;  ///< empty: nothing was compared
};

/// All inputs, or fewer where that lowers the error on held-out rows by more than chance. `plan`: for all inputs;
/// `served`: the outputs; `weights`: of their squared errors; `work`: the choice
/// counts as a part of it.
ChosenInputs choose_inputs(const TrainingRows& all, const std::vector<FoldRows>& folds, const std::vector<int>& served,
                           const Eigen::VectorXd& weights, const Plan& plan, const FitOptions& options, Work& work);

}  // namespace llmt
