// Properties of every family and every candidate under the best explanation: steps 7 and 8 of search().
#pragma once

#include <string>
#include <vector>

#include "discovery/search/scoring.hpp"

namespace llmt::discovery {

/// The finding of one family of `set`. `whole` is the best explanation before immaterial families are dropped; rivals
/// are compared within it.
Finding finding_of(const Scoring& scoring, const Set& set, const Set& whole, const std::string& family,
                   const SearchOptions& options);

/// Causes that would beat `set` by more than `margin`, alone or added to it, if values beyond their limits were
/// allowed: the best one of each family, by falling gain.
std::vector<Refused> refused_beyond_limits(const Scoring& scoring, const Set& set, double margin);

/// Scatter of repeats about their means, of samples that are in use.
LackOfFit lack_of_fit(const Scoring& scoring, const SetFit& fit, const std::vector<Eigen::Index>& repeats,
                      const Eigen::VectorXd& remaining);

/// The sizes from which on every candidate would have been found at this threshold and noise.
std::vector<Sensitivity> sensitivities(const Scoring& scoring, double threshold, double noise);

}  // namespace llmt::discovery
