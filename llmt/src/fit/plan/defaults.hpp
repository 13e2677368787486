/// \file
/// The options of a fit without blanks.
#pragma once

#include "data/training.hpp"
#include "growth/rules/rule.hpp"
#include "selection/candidates.hpp"

namespace llmt {

/// What is grown, and what is compared on held-out rows.
struct Plan {
  const Rule* rule = nullptr;
  GrowthOptions growth;
  Candidates candidates;
  Pruning pruning = Pruning::last_splits;
  bool leaves_given = false;  ///< FitOptions::max_leaves is set: growth.max_leaves is not a default
};

/// Fills in the defaults, which depend on the rows and on the number of folds. default_text() describes them.
Plan with_defaults(const FitOptions& options, const TrainingRows& all, Eigen::Index folds);

/// with_defaults() of a training.
inline Plan plan_of(const Training& training) {
  return with_defaults(training.options, training.all, std::ssize(training.folds));
}

}  // namespace llmt
