/// \file
/// The growth rules of the library.
#pragma once

#include <vector>

#include "growth/best_first/best_first.hpp"
#include "growth/hilomot/hilomot.hpp"
#include "growth/lolimot/lolimot.hpp"
#include "growth/m5/growth.hpp"
#include "growth/rules/rule.hpp"

namespace llmt {

template <SplitCriterion criterion>
GrownPartition grow_best_first(const GrowthProblem& problem) {
  GrowthProblem with_criterion = problem;
  with_criterion.criterion = criterion;
  return grow(with_criterion);
}

template <bool data_driven>
GrownPartition grow_lolimot_in_extent(const GrowthProblem& problem) {
  const std::vector<int>& inputs = problem.options.split_inputs;
  return grow_lolimot(problem, {.width = problem.after.width,
                                .low = problem.training->low()(inputs),
                                .high = problem.training->high()(inputs),
                                .data_driven = data_driven,
                                .stop_by_aicc = problem.after.keeps_all_leaves});
}

inline GrownPartition grow_hilomot_as_estimated(const GrowthProblem& problem) {
  return grow_hilomot(problem, {.models = problem.after.joint ? GateModels::joint : GateModels::local,
                                .stop_by_aicc = problem.after.keeps_all_leaves && !problem.after.has_leaf_limit});
}

/// One row each, in the order of GrowthRule.
inline std::vector<Rule> library_rules() {
  using enum ValidityChoice;
  return {
      {.name = "rd",
       .title = "RD",
       .summary = "best split by F test",
       .grow = grow_best_first<SplitCriterion::f_test>,
       .usual_method = "crisp tree, RD",
       .is_read_most_easily = true},
      {.name = "retis",
       .title = "RETIS",
       .summary = "no test, pruned by m-estimates",
       .grow = grow_best_first<SplitCriterion::smallest_rss>,
       .usual_method = "crisp tree, RETIS"},
      {.name = "lolimot",
       .title = "LOLIMOT",
       .summary = "halves boxes, Gaussians",
       .grow = grow_lolimot_in_extent<false>,
       .overlapping = ValidityKind::gaussian,
       .most_leaves = 100,
       .most_leaves_without_folds = true,
       .grows_larger_to_be_pruned = false,
       .splits_on_monotone_inputs = false,
       .keeps_signs = true,
       .usual_method = "LOLIMOT"},
      {.name = "lolimot-data",
       .title = "LOLIMOT with thresholds from the data",
       .summary = "lolimot with thresholds from the data",
       .grow = grow_lolimot_in_extent<true>,
       .overlapping = ValidityKind::gaussian,
       .most_leaves = 100,
       .most_leaves_without_folds = true,
       .grows_larger_to_be_pruned = false,
       .splits_on_monotone_inputs = false,
       .keeps_signs = true},
      {.name = "ra",
       .title = "RA",
       .summary = "splits by the signs of residuals, no search",
       .grow = grow_best_first<SplitCriterion::residual_signs>,
       .usual_method = "crisp tree, RA"},
      {.name = "m5",
       .title = "M5'",
       .summary = "M5', pruned and smoothed",
       .grow = grow_m5,
       .validities = {automatic, crisp},
       .overlapping = ValidityKind::crisp,
       .fewest_rows = 2,  // fewer than four rows are not split (Quinlan 1992)
       .splits_on_monotone_inputs = false,
       .has_own_models = true,
       .usual_method = "M5', smoothed"},
      {.name = "hilomot",
       .title = "HILOMOT",
       .summary = "oblique splits, logistic gates",
       .grow = grow_hilomot_as_estimated,
       .validities = {automatic, crisp},
       .overlapping = ValidityKind::logistic,
       .most_leaves = 50,
       .grows_larger_to_be_pruned = false,
       .splits_on_monotone_inputs = false,
       .usual_method = "HILOMOT"},
  };
}

}  // namespace llmt
