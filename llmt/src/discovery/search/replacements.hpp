// Explanations with one family in the place of another.
#pragma once

#include <string>
#include <vector>

#include "discovery/search/scoring.hpp"

namespace llmt::discovery {

/// Members of the family are replaced by the best few of another one, or by the same family elsewhere: those that
/// explain as well, by rising score. What predicts the same at the same places and is more complex is no rival.
std::vector<Rival> rivals_of(const Scoring& scoring, const Set& set, const std::string& family,
                             const SearchOptions& options);

/// `set`, where families give way to less complex ones that predict the same at every sample with no more candidates
/// (EffectCandidate::complexity).
Set least_complex(const Scoring& scoring, Set set, const SearchOptions& options);

}  // namespace llmt::discovery
