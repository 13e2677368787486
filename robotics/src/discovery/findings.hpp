// What a search found, as effects, shapes and limits of a robot.
#pragma once

#include <vector>

#include "discovery/second_look.hpp"
#include "hypotheses/hypothesis.hpp"

namespace llmt::robotics {

void describe_effects(const std::vector<Hypothesis>& hypotheses, const discovery::Verdict& verdict,
                      const Calibration& fitted, double mass_uncertainty, Discovery& result);
void describe_shapes(const std::vector<Hypothesis>& hypotheses, const discovery::Verdict& verdict,
                     std::vector<FoundShape>& shapes);

/// What a second look found beside the large effects: names, and shapes that have none.
void describe_smaller(const SecondLook& look, const std::vector<Hypothesis>& large, const discovery::Verdict& verdict,
                      const Calibration& fitted, const DiscoveryOptions& options, Discovery& result);

/// Discovery::not_testable and visible: which effects could not be tested, and from which size on the others would have
/// been found.
void describe_limits(const std::vector<Hypothesis>& hypotheses,
                     const std::vector<discovery::UntestableCause>& untestable, const discovery::Verdict& verdict,
                     const Robot& robot, Discovery& result);

/// Discovery::beyond_plausible: what the search refused, and what ended too large when everything was fitted together.
void describe_refused(const Investigation& investigation, const Robot& robot, Discovery& result);

}  // namespace llmt::robotics
