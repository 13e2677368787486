// What is left once everything that was found is taken as known.
#pragma once

#include <optional>

#include "discovery/investigation.hpp"

namespace llmt::robotics {

/// What a second search found.
struct SecondLook {
  EffectQuestion asked;  ///< without signatures
  discovery::Verdict verdict;
};

/// Searches what the model with the found effects leaves. A small effect beside a large one is a small share of what
/// was explained, and all of what is left. Effects that are found are added and everything is fitted together, if that
/// lowers the error on poses left out. Nothing if nothing is left.
std::optional<SecondLook> look_again(Investigation& investigation, const DiscoveryOptions& options);

/// Whether the effect changes with time: drift, a knock, thermal growth.
bool depends_on_time(const std::string& name);

/// Whether a small effect may be no more than the error of a large one that was found: what depends on weight is known
/// as closely as masses and levers are, and what a joint does as closely as the formula for it.
bool may_be_an_error_of(const std::vector<Hypothesis>& large, const Effect& small);

}  // namespace llmt::robotics
