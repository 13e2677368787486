/// \file
/// From a grown tree and a choice to the result of a fit.
#pragma once

#include <optional>
#include <vector>

#include "fit/choices/input_choice.hpp"
#include "fit/prepared_rows.hpp"
#include "fit/same_regressors.hpp"
#include "fit/trees/grow_tree.hpp"
#include "fit/trees/held_out_error.hpp"
#include "llmt/fit_result.hpp"

namespace llmt {

/// A partition of the model, and of the folds' models.
struct FittedPartition {
  PartitionOn of_all;
  PartitionSummary summary;
  std::vector<PartitionOn> of_folds;  ///< empty without FitOptions::intervals
};

/// Estimates the chosen candidate on the tree of all rows and in every fold, and decides on the guard of the range.
/// `of_folds`: empty without folds, where the plan's first candidate is taken. `work`: what is left of it.
FittedPartition finish(const ChosenInputs& inputs, const Plan& plan, const FinalTree& grown, HeldOutFits of_folds,
                       Work& work);

/// Model, summary and intervals of all partitions.
FitResult assemble(const Training& training, std::vector<std::optional<FittedPartition>> fitted);

/// The result with what was decided before the fit: codes in place of their positions, the loss, copies and folds.
FitResult with_choices(FitResult result, const PreparedRows& rows);

}  // namespace llmt
