// What the search is asked at the present estimates.
#pragma once

#include <vector>

#include "hypotheses/hypothesis.hpp"
#include "llmt/robotics/discovery_options.hpp"
#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {

/// What the search is to explain at the current estimates: the robot's found effects compete anew, with what they
/// explain added back to the residuals.
struct EffectQuestion {
  discovery::Evidence evidence;
  std::vector<Hypothesis> hypotheses;
  std::vector<discovery::UntestableCause> untestable;
};

/// The last effects of the robot are those that were found.
EffectQuestion question(const Robot& robot, const std::vector<Hypothesis>& found, const Measurements& measurements,
                        const DiscoveryOptions& options);

/// The candidates of the hypotheses, in their order.
std::vector<discovery::EffectCandidate> candidates_of(const EffectQuestion& question);

/// Frees the memory of what only the search needs.
void forget_signatures(EffectQuestion& question);

/// The hypotheses of the verdict that are effects, with their values.
std::vector<Hypothesis> effects_of(const EffectQuestion& question, const discovery::Verdict& verdict);

}  // namespace llmt::robotics
