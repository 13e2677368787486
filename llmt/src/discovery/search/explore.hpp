// Searches for the best set of candidates.
#pragma once

#include "discovery/search/scoring.hpp"

namespace llmt::discovery {

struct Explained {
  Set set;
  double score = impossible;
};

/// Best set of the allowed candidates by add, drop and swap moves from several starts; `start` is one of them.
Explained best_set(const Scoring& scoring, const std::vector<bool>& allowed, const Set& start, int largest_set);

/// Outliers and candidates in one forward search: which samples fit nothing. At most `largest` samples.
std::vector<std::size_t> competing_outliers(const Workspace& workspace, const std::vector<EffectCandidate>& candidates,
                                            int largest_set, std::size_t largest);

/// Samples that do not fit the given explanation, one after the other.
std::vector<std::size_t> outliers_given(const Workspace& workspace, const std::vector<EffectCandidate>& candidates,
                                        const Set& set, std::size_t largest);

}  // namespace llmt::discovery
