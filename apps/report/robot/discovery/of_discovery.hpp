/// \file
/// The report of `llmt-robot discover`.
#pragma once

#include <string>
#include <vector>

#include "llmt/robotics/discovery/discovery_result.hpp"
#include "report/document/document.hpp"
#include "report/robot/discovery/next_poses.hpp"

namespace llmt::report {

struct Discovered {
  std::string robot;  ///< the file
  std::string data;   ///< the file
  const robotics::Measurements& measurements;
  const robotics::Discovery& found;
  const std::vector<NextPoses>& next;
};

Document discovery_report(const Discovered& discovered);

}  // namespace llmt::report
