#include "report/robot/arm_tables.hpp"

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <vector>

#include "llmt/robotics/compensation.hpp"
#include "llmt/robotics/orientation.hpp"

namespace llmt::report {

robotics::Measurements predicted_table(const std::string& file, const robotics::CorrectedRobot& robot,
                                       const robotics::Poses& given, const std::string& orientation, const Warn& warn,
                                       const Progress& progress) {
  Work work(progress);
  robotics::Measurements predicted;
  predicted.poses = robotics::with_needed_columns(robot.robot, robotics::with_approach(robot.robot, given), 1);
  predicted.session = robot.robot.chain.session;
  predicted.target = robot.robot.chain.target;
  name_made_up(given, predicted.poses, warn);
  name_uncovered(robot.robot, predicted.poses, warn);
  const Eigen::Index count = predicted.poses.count();
  predicted.positions_mm.resize(count, 3);
  std::vector<Eigen::Matrix3d> rotations;
  constexpr Eigen::Index block = 20000;  // between blocks the work may be stopped
  for (Eigen::Index first = 0; first < count; first += block) {
    std::vector<Eigen::Index> rows(std::min(block, count - first));
    std::iota(rows.begin(), rows.end(), first);
    const robotics::Poses part = robotics::select(predicted.poses, rows);
    // The refusal of all has the number of the pose.
    if (!robotics::position_refusal(robot.robot, part).empty()) check_positions(file, robot.robot, predicted.poses);
    for (const robotics::Pose& tool : robotics::tool_poses(robot, part)) {
      predicted.positions_mm.row(std::ssize(rotations)) = tool.position_mm.transpose();
      rotations.push_back(tool.rotation);
    }
    work.did(0.9 * static_cast<double>(rows.size()) / static_cast<double>(count));
  }
  predicted.orientation =
      robotics::to_orientation(rotations, orientation.empty() ? robot.robot.chain.orientation : orientation);
  work.finish();
  return predicted;
}

robotics::Measurements simulated_table(const std::string& file, const robotics::CorrectedRobot& robot,
                                       const std::optional<robotics::Poses>& poses,
                                       const robotics::SimulationOptions& options) {
  Work work(options.progress);
  Work simulating(work, robot.correction ? 0.5 : 1.0);
  robotics::SimulationOptions of_arm = options;
  of_arm.progress = simulating.progress();
  robotics::Measurements simulated;
  try {
    simulated = poses ? robotics::simulate(robot.robot, *poses, of_arm) : robotics::simulate(robot.robot, of_arm);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(file + ": " + error.what());
  }
  if (robot.correction) {
    simulated.positions_mm +=
        robotics::positions(robot, simulated.poses) - robotics::positions(robot.robot, simulated.poses);
  }
  work.finish();
  return simulated;
}

}  // namespace llmt::report
