// A search in the residuals that the found effects leave.
#pragma once

#include <optional>

#include "discovery/investigation/investigation.hpp"

namespace llmt::robotics {

/// The outcome of a second search, which takes the found effects as known.
struct ResidualSearch {
  EffectQuestion asked;  ///< without signatures
  discovery::Verdict verdict;
};

/// Searches the residuals of the fit with the found effects. A small effect beside a large one is a small share of the
/// explained sum of squares, but a large share of these residuals. Effects found now are added to the investigation and
/// everything is fitted together, if that lowers the leave-one-pose-out error. Returns nothing if nothing was found.
std::optional<ResidualSearch> search_residuals(Investigation& investigation, const DiscoveryOptions& options);

/// True if the effect changes with time: drift, a knock, thermal growth.
bool depends_on_time(const Effect& effect);

/// True if a small effect may be no more than the error of a large one that was found. Effects of weight are known only
/// as closely as masses and levers, those of a joint only as closely as the formula for it.
bool may_be_an_error_of(const std::vector<Hypothesis>& large, const Effect& small);

}  // namespace llmt::robotics
