/// \file
/// Poses to measure next, where what was found has a rival.
#pragma once

#include <string>
#include <vector>

#include "llmt/robotics/discovery/discovery_result.hpp"
#include "llmt/robotics/discovery/discriminating_poses.hpp"

namespace llmt::report {

/// Poses at which a finding and its first rival predict different positions.
struct NextPoses {
  std::string effect;  ///< in words
  std::string rival;   ///< in words
  robotics::Discrimination telling;
};

/// For every confirmed effect that has a rival which measurements can tell apart from it.
std::vector<NextPoses> next_poses(const robotics::Discovery& found, const robotics::Measurements& data);

std::string next_poses_text(const std::vector<NextPoses>& next);

}  // namespace llmt::report
