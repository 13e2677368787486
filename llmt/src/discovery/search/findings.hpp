// What the best explanation says of every family and every candidate: steps 7 and 8 of search().
#pragma once

#include <set>
#include <string>
#include <vector>

#include "discovery/search/scoring.hpp"

namespace llmt::discovery {

std::set<std::string> families_of(const Scoring& scoring, const Set& set);

Set without_family(const Scoring& scoring, const Set& set, const std::string& family);

/// Share of the sum of squares explained by `set` that is lost where only `rest`, a subset of it, explains.
double share_of(const Scoring& scoring, const Set& set, const Set& rest);

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

/// What every candidate could have shown at this threshold and noise.
std::vector<Sensitivity> sensitivities(const Scoring& scoring, double threshold, double noise);

}  // namespace llmt::discovery
