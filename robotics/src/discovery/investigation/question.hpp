// The question to the search at the present estimates: residuals, Jacobian and hypotheses.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "hypotheses/hypothesis.hpp"
#include "llmt/robotics/discovery/discovery_options.hpp"
#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {

/// Residuals, Jacobian and hypotheses at the current estimates. The robot's found effects compete anew: the part that
/// they explain is added back to the residuals.
struct EffectQuestion {
  discovery::Evidence evidence;
  std::vector<Hypothesis> hypotheses;
  std::vector<discovery::UntestableCause> untestable;
};

/// The last effects of the robot are those that were found.
EffectQuestion question(const Robot& robot, const std::vector<Hypothesis>& found, const Measurements& measurements,
                        const DiscoveryOptions& options);

/// Removes the hypotheses of these effects, which are given by label.
void exclude_effects(const std::map<std::string, Effect>& effects, EffectQuestion& question);

/// The candidates of the hypotheses, in their order.
std::vector<discovery::EffectCandidate> candidates_of(const EffectQuestion& question);

/// Frees the memory of residuals, Jacobian and signatures, which only the search needs.
void forget_signatures(EffectQuestion& question);

/// The hypotheses of the verdict that are effects, with their values.
std::vector<Hypothesis> effects_of(const EffectQuestion& question, const discovery::Verdict& verdict);

}  // namespace llmt::robotics
