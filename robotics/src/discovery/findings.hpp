// What a search found, in the terms of the robot.
#pragma once

#include <vector>

#include "hypotheses/hypothesis.hpp"

namespace llmt::robotics {

void describe_effects(const std::vector<Hypothesis>& hypotheses, const discovery::Verdict& verdict,
                      const Calibration& fitted, double mass_uncertainty, Discovery& result);
void describe_shapes(const std::vector<Hypothesis>& hypotheses, const discovery::Verdict& verdict, Discovery& result);

/// What could not be told, and from what size on it would have been.
void describe_limits(const std::vector<Hypothesis>& hypotheses, const std::vector<UntestableEffect>& untestable,
                     const discovery::Verdict& verdict, const Robot& robot, Discovery& result);

}  // namespace llmt::robotics
