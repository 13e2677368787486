#include "report/robot/arm_tables.hpp"

#include <stdexcept>
#include <vector>

#include "llmt/robotics/compensation.hpp"
#include "llmt/robotics/orientation.hpp"

namespace llmt::report {

robotics::Measurements predicted_table(const std::string& file, const robotics::CorrectedRobot& robot,
                                       const robotics::Poses& given, const std::string& orientation, const Warn& warn) {
  robotics::Measurements predicted;
  predicted.poses = robotics::with_needed_columns(robot.robot, robotics::with_approach(robot.robot, given), 1);
  name_made_up(given, predicted.poses, warn);
  check_positions(file, robot.robot, predicted.poses);
  const std::vector<robotics::Pose> tools = robotics::tool_poses(robot, predicted.poses);
  predicted.positions_mm.resize(std::ssize(tools), 3);
  std::vector<Eigen::Matrix3d> rotations;
  for (std::size_t i = 0; i < tools.size(); ++i) {
    predicted.positions_mm.row(i) = tools[i].position_mm.transpose();
    rotations.push_back(tools[i].rotation);
  }
  predicted.orientation =
      robotics::to_orientation(rotations, orientation.empty() ? robot.robot.chain.orientation : orientation);
  return predicted;
}

robotics::Measurements simulated_table(const std::string& file, const robotics::CorrectedRobot& robot,
                                       const std::optional<robotics::Poses>& poses,
                                       const robotics::SimulationOptions& options) {
  robotics::Measurements simulated;
  try {
    simulated = poses ? robotics::simulate(robot.robot, *poses, options) : robotics::simulate(robot.robot, options);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(file + ": " + error.what());
  }
  if (robot.correction) {
    simulated.positions_mm +=
        robotics::positions(robot, simulated.poses) - robotics::positions(robot.robot, simulated.poses);
  }
  return simulated;
}

}  // namespace llmt::report
