// What a search found, in the terms of the robot.
#pragma once

#include "hypotheses.hpp"

namespace llmt::robotics {

void describe_effects(const std::vector<Hypothesis>& hypotheses, const discovery::Verdict& verdict,
                      const Calibration& fitted, double mass_uncertainty, Discovery& result);
void describe_shapes(const std::vector<Hypothesis>& hypotheses, const discovery::Verdict& verdict, Discovery& result);

/// What could not be told, and from what size on it would have been.
void describe_limits(const std::vector<Hypothesis>& hypotheses, const std::vector<Untestable>& untestable,
                     const discovery::Verdict& verdict, const Robot& robot, Discovery& result);

/// Where the gap of `before` is (step "locate").
void locate(const Measurements& searched, Discovery& result);

/// A tree of what the improved robot leaves, kept if it lowers the error of poses left out by more than two standard
/// errors.
void correct_rest(const Measurements& searched, const DiscoveryOptions& options, Discovery& result);

}  // namespace llmt::robotics
