/// \file
/// The options of a fit without blanks.
#pragma once

#include "selection/selection.hpp"

namespace llmt {

/// What is compared, and growth options without blanks.
struct Plan {
  GrowthOptions growth;
  Candidates candidates;
  bool leaves_given = false;  ///< by GrowthOptions::max_leaves: what growth.max_leaves says is not a default
};

bool is_lolimot(GrowthRule rule);
bool is_hilomot(GrowthRule rule);

/// Fills in the defaults, which depend on the data and on the number of folds.
Plan make_plan(const FitOptions& options, const TrainingRows& all, Eigen::Index folds);

}  // namespace llmt
