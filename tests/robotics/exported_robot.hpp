// Robots exported as C, compiled and run.
#pragma once

#include <fmt/format.h>

#include <limits>
#include <vector>

#include "llmt/robotics/compensation.hpp"
#include "llmt/robotics/robot_c_source.hpp"
#include "oracles/compiled_c.hpp"

namespace llmt::robotics {

/// A row in: conditions, drives, position, rotation; out: position and rotation at the drives, drives after twelve
/// steps.
inline const char* const driver = R"(#include <stdio.h>
#include "arm.h"
int main(void) {{
  double in[{0} + {1} + 12], out[12 + {1}];
  while (fread(in, sizeof(double), {0} + {1} + 12, stdin) == {0} + {1} + 12) {{
    int k;
    arm_forward(in, in + {0}, out, out + 3);
    for (k = 0; k < 12; ++k) arm_step(in, in + {0} + {1}, in + {0} + {1} + 3, in + {0});
    for (k = 0; k < {1}; ++k) out[12 + k] = in[{0} + k];
    fwrite(out, sizeof(double), 12 + {1}, stdout);
  }}
  return 0;
}}
)";

/// Exports robots as C, compiles and runs them.
class ExportedRobot : public oracle::CompiledC {
 protected:
  oracle::Rows run(const CorrectedRobot& robot, const oracle::Rows& in) const {
    const std::size_t conditions = c_conditions(robot.robot).size();
    const Eigen::Index joints = drive_count(robot.robot.chain);
    return run_c(to_c(robot, "arm", "arm.h"), "arm", fmt::format(fmt::runtime(driver), conditions, joints), in,
                 12 + joints);
  }

  static std::vector<Eigen::Index> drives_of(const Chain& chain) {
    std::vector<Eigen::Index> drives;
    for (std::size_t j = 0; j < chain.joints.size(); ++j) {
      if (!chain.joints[j].mimic) drives.push_back(static_cast<Eigen::Index>(j));
    }
    return drives;
  }

  // oracle::Rows of what the program reads: the start, and the poses of the nominal arm as what is asked for.
  static oracle::Rows asked(const CorrectedRobot& robot, const Targets& targets) {
    const std::vector<std::string> columns = c_conditions(robot.robot);
    const std::vector<Eigen::Index> drives = drives_of(robot.robot.chain);
    const auto behind = std::ssize(columns) + std::ssize(drives);
    oracle::Rows in(targets.start.count(), behind + 12);
    for (Eigen::Index i = 0; i < in.rows(); ++i) {
      for (std::size_t k = 0; k < columns.size(); ++k) in(i, k) = targets.start.covariates.at(columns[k])(i);
      in.row(i).segment(std::ssize(columns), std::ssize(drives)) = targets.start.joints(i, drives);
      in.row(i).segment(behind, 3) = targets.positions_mm.row(i);
      for (int k = 0; k < 9; ++k) in(i, behind + 3 + k) = targets.rotations[i](k / 3, k % 3);
    }
    return in;
  }

  static Targets targets_of(const Robot& nominal, Poses poses) {
    poses.covariates["payload_kg"] = Eigen::VectorXd::Constant(poses.count(), 2.5);
    Targets targets{.start = poses, .positions_mm = positions(nominal, poses)};
    for (const Pose& pose : tool_poses(nominal, poses)) targets.rotations.push_back(pose.rotation);
    return targets;
  }

  // Compares tool poses with those of the library. Returns the largest difference of positions in units in the last
  // place of the reach.
  double forward_apart(const CorrectedRobot& robot, const Poses& poses) const {
    const oracle::Rows out = run(robot, asked(robot, targets_of(robot.robot, poses)));
    return apart(robot, targets_of(robot.robot, poses).start, out);
  }

  static double apart(const CorrectedRobot& robot, const Poses& poses, const oracle::Rows& out) {
    const std::vector<Pose> expected = tool_poses(robot, poses);
    double largest = 0.0;
    for (Eigen::Index i = 0; i < poses.count(); ++i) {
      largest = std::max(largest, (out.row(i).head(3).transpose() - expected[i].position_mm).cwiseAbs().maxCoeff());
      for (int k = 0; k < 9; ++k) EXPECT_NEAR(out(i, 3 + k), expected[i].rotation(k / 3, k % 3), 1e-13);
    }
    return largest / (reach_of(robot.robot.chain) * std::numeric_limits<double>::epsilon());
  }
};

}  // namespace llmt::robotics
