/// \file
/// The candidate whose runs over held-out stretches are best.
#pragma once

#include <functional>
#include <vector>

#include "dynamics/model_structure.hpp"
#include "dynamics/stretches.hpp"
#include "llmt/progress.hpp"

namespace llmt {

/// A candidate and the sums of its held-out runs.
struct Trial {
  ModelStructure candidate;
  Judged judged = {};
  double error = 0.0;
};

/// What choose() found: the trials that were judged on all folds, by error; the first one need not be the smallest, see
/// fit_dynamic().
struct Chosen {
  std::vector<Trial> trials;
  std::size_t chosen = 0;
  std::vector<int> delays = {};  ///< see DynamicSummary
};

/// Rows that a search of lags and candidates looks at; with more rows the best ones meet again on all of them.
inline constexpr Eigen::Index search_rows = 4096;
/// Steps of the estimation on runs in the search, and where the best ones meet.
inline constexpr int search_iterations = 15;
inline constexpr int final_iterations = 40;

/// Judges candidates on folds, all at once.
void try_on(const Task& task, const std::vector<StretchFold>& folds, int iterations, std::vector<Trial>& trials,
            Work& work);

/// The best candidate for the stretches of the task. Sets stops of `task.outputs` where they help.
Chosen choose(Task& task, const std::vector<Stretch>& stretches, const DynamicOptions& options, Work& work);

/// The error in rows of the largest amplitudes of runs of a candidate that was learned without them.
double error_beyond(const Task& task, const ModelStructure& candidate, const std::vector<Stretch>& stretches);

}  // namespace llmt
