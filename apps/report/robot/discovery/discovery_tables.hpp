/// \file
/// Tables of the report of `llmt-robot discover`.
#pragma once

#include <string>

#include "llmt/robotics/discovery/discovery_result.hpp"
#include "report/document/document.hpp"
#include "report/robot/discovery/next_poses.hpp"

namespace llmt::report {

/// "periodic error of the gear of joint1 (order_per_turn 26)".
std::string title_of(const robotics::FoundEffect& effect);

/// What was added: patterns without a name and free maps first, then effects with their values.
Json effects_table(const robotics::Discovery& found);

/// Causes of one kind and reason in one row.
Json untestable_table(const robotics::Discovery& found);

/// The poses at which two explanations differ most.
Json next_table(const robotics::Chain& chain, const NextPoses& next);

/// Of each kind of effect, the smallest size that would have been seen, at its best and at its worst place.
Json visible_table(const robotics::Discovery& found);

}  // namespace llmt::report
