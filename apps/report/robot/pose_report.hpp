/// \file
/// Poses that were chosen for a calibration, as a table, as text and as JSON.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "llmt/robotics/pose_selection.hpp"
#include "report/text/json.hpp"
#include "report/text/text.hpp"

namespace llmt::report {

/// Names of robotics::PoseCriterion, in its order.
inline constexpr std::array pose_criteria = {"position", "O1", "O2", "O3", "O4", "O5"};

/// Throws std::invalid_argument if there is no such criterion.
robotics::PoseCriterion pose_criterion(const std::string& name);

/// The robot for the next poses, which are of one session and one target. `tool_mm`: the measured point on the flange;
/// empty: the tool of the description.
robotics::Robot robot_to_measure(robotics::Robot robot, const std::vector<double>& tool_mm);

/// What was chosen, and from what.
struct PoseFacts {
  std::string robot_file;
  std::string from;  ///< the name of the table of candidates; empty: none
  std::string use;   ///< the name of the table of poses of use; empty: none
  double noise_um = 0.0;
  const robotics::Robot& robot;
  const robotics::PosePlan& plan;
  const robotics::PoseSelectionOptions& options;
  const robotics::PoseSelection& selection;
  Face face = {};
};

/// Joint values in degrees, to thousandths, or mm, to micrometres; and the covariates.
std::string poses_csv(const robotics::Robot& robot, const robotics::Poses& poses);

/// For people: what is expected of these poses, and of random ones. `width`: of tables.
std::string poses_text(const PoseFacts& facts, std::size_t width = no_width_limit);

/// `output`: file of the poses, or empty.
Json poses_json(const PoseFacts& facts, const std::string& output);

}  // namespace llmt::report
