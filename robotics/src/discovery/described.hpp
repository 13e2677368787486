// What a discovery says of its findings.
#pragma once

#include <vector>

#include "discovery/investigation/pose_split.hpp"
#include "discovery/judges/decision.hpp"
#include "discovery/judges/findings.hpp"
#include "llmt/robotics/discovery/discovery_result.hpp"

namespace llmt::robotics {

/// `result` has the robots and their errors; answer, names, patterns, gap and limits are filled in.
Discovery described(Discovery result, const Findings& found, const std::vector<Objection>& objections,
                    const PoseSplit& split);

}  // namespace llmt::robotics
