// What a search found, as effects, shapes and limits of a robot.
#pragma once

#include <vector>

#include "hypotheses/hypothesis.hpp"

namespace llmt::robotics {

void describe_effects(const std::vector<Hypothesis>& hypotheses, const discovery::Verdict& verdict,
                      const Calibration& fitted, double mass_uncertainty, Discovery& result);
void describe_shapes(const std::vector<Hypothesis>& hypotheses, const discovery::Verdict& verdict, Discovery& result);

/// Discovery::not_testable and visible: which effects could not be tested, and from which size on the others would have
/// been found.
void describe_limits(const std::vector<Hypothesis>& hypotheses,
                     const std::vector<discovery::UntestableCause>& untestable, const discovery::Verdict& verdict,
                     const Robot& robot, Discovery& result);

}  // namespace llmt::robotics
