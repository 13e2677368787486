// The exported robot, compiled and run, against the library.
#include "llmt/robotics/robot_c_source.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "llmt/fit.hpp"
#include "llmt/robotics/compensation.hpp"
#include "oracles/compiled_c.hpp"
#include "robotics/robots.hpp"

namespace llmt::robotics {
namespace {

using oracle::Rows;

// A row in: conditions, drives, position, rotation; out: position and rotation at the drives, drives after twelve
// steps.
const char* const driver = R"(#include <stdio.h>
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

class RobotCSource : public oracle::CompiledC {
 protected:
  Rows run(const CorrectedRobot& robot, const Rows& in) const {
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

  // Rows of what the program reads: the start, and the poses of the nominal arm as what is asked for.
  static Rows asked(const CorrectedRobot& robot, const Targets& targets) {
    const std::vector<std::string> columns = c_conditions(robot.robot);
    const std::vector<Eigen::Index> drives = drives_of(robot.robot.chain);
    const auto behind = std::ssize(columns) + std::ssize(drives);
    Rows in(targets.start.count(), behind + 12);
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

  // Where compensate() reaches a target, the steps do, by the same measure.
  void expect_steps_reach(const CorrectedRobot& robot, const Robot& nominal, const Poses& poses) {
    const Targets targets = targets_of(nominal, poses);
    const CompensationOptions options;
    const Compensation found = compensate(robot, targets, options);
    const std::vector<Eigen::Index> drives = drives_of(robot.robot.chain);
    const Rows out = run(robot, asked(robot, targets));
    Poses reached = targets.start;
    reached.joints(Eigen::all, drives) = out.rightCols(std::ssize(drives));
    reached.joints = with_mimics(robot.robot.chain, reached.joints);
    const std::vector<Pose> tools = tool_poses(robot, reached);
    Eigen::Index judged = 0;
    for (Eigen::Index i = 0; i < reached.count(); ++i) {
      if (found.outcomes[i] != Outcome::reached) continue;
      ++judged;
      double off_mm = (tools[i].position_mm - targets.positions_mm.row(i).transpose()).norm();
      if (std::ssize(drives) >= 6) {
        off_mm += reach_of(robot.robot.chain) * (tools[i].rotation - targets.rotations[i]).norm();
      }
      EXPECT_LT(off_mm, 2.0 * options.tolerance_mm) << i;
    }
    EXPECT_GT(judged, reached.count() / 2);
  }

  // Asks for the poses of the nominal arm. Returns the largest difference in units in the last place of the reach.
  double compare(const CorrectedRobot& robot, const Robot& nominal, Poses poses, bool same_commands) {
    const Targets targets = targets_of(nominal, poses);
    poses = targets.start;
    const std::vector<Eigen::Index> drives = drives_of(robot.robot.chain);
    const auto joints = std::ssize(drives);
    const Rows in = asked(robot, targets);
    const Rows out = run(robot, in);
    const std::vector<Pose> expected = tool_poses(robot, poses);
    const Compensation found = compensate(robot, targets);
    double apart = 0.0;
    for (Eigen::Index i = 0; i < poses.count(); ++i) {
      apart = std::max(apart, (out.row(i).head(3).transpose() - expected[i].position_mm).cwiseAbs().maxCoeff());
      for (int k = 0; k < 9; ++k) EXPECT_NEAR(out(i, 3 + k), expected[i].rotation(k / 3, k % 3), 1e-13);
      if (!same_commands || found.outcomes[i] != Outcome::reached) continue;
      EXPECT_LT((out.row(i).tail(joints) - found.commands.joints(i, drives)).norm(), 1e-9) << i;
    }
    return apart / (reach_of(robot.robot.chain) * std::numeric_limits<double>::epsilon());
  }
};

Robot with_masses(Robot robot) {
  for (Joint& joint : robot.chain.joints) {
    joint.mass_kg = 5.0;
    joint.com_mm = {30.0, 10.0, 20.0};
  }
  robot.chain.payload.com_mm = {10.0, 0.0, 50.0};
  return robot;
}

constexpr double bound_ulp = 32.0;  // of the arm's reach: some 60 products of rounded matrices

TEST_F(RobotCSource, ForwardModelAndCommandsAreThoseOfTheLibrary) {
  const Robot nominal = with_masses(ur_like());
  CorrectedRobot robot{.robot = perturbed(nominal, 0.5, 0.03, 3), .correction = {}};
  robot.robot.chain.base = nominal.chain.base;
  robot.robot.effects = {{.type = "joint_compliance", .at = "joint2", .values = {5e-6}},
                         {.type = "transmission_error", .at = "joint2", .values = {3e-4, 2e-4}, .constants = {2.0}},
                         {.type = "eccentricity", .at = "joint1", .values = {3e-4, 2e-4}},
                         {.type = "backlash_approach", .at = "joint1", .values = {2e-4}},
                         {.type = "joint_map", .at = "joint4", .values = {1e-4, 0.0, -1e-4}, .constants = {-2.0, 1.0}},
                         {.type = "wrist_coupling", .at = "joint6", .values = {1e-4}},
                         {.type = "joint_gain", .at = "joint5", .values = {1e-4}}};
  Poses poses = random_poses(nominal.chain, 300, 5);
  Random random(6);
  poses.covariates["dir1"] = Eigen::VectorXd::NullaryExpr(300, [&] { return random.uniform() < 0.5 ? -1.0 : 1.0; });
  const double apart = compare(robot, nominal, poses, true);
  EXPECT_LT(apart, bound_ulp);
  RecordProperty("ulp", fmt::format("{}", apart));
}

TEST_F(RobotCSource, JumpingEffectsTreesPrismaticAndRedundantArmsAreThoseOfTheLibrary) {
  for (const Robot& nominal : {with_masses(scara()), with_masses(seven_axes()), with_masses(mdh_like())}) {
    CorrectedRobot robot{.robot = nominal, .correction = {}};
    robot.robot.chain.base.rpy_deg = {10.0, 20.0, 30.0};
    robot.robot.effects = {{.type = "backlash_gravity", .at = "joint2", .values = {1e-4}},
                           {.type = "joint_compliance", .at = "joint3", .values = {1e-6}}};
    const Poses poses = random_poses(nominal.chain, 300, 8);
    Eigen::MatrixXd error(300, 4);
    for (Eigen::Index i = 0; i < 300; ++i) {
      const double q = poses.joints(i, 0);
      error.row(i) << std::sin(q), std::abs(poses.joints(i, 1)), 1e-3 * std::sin(q), 2e-3 * std::cos(q);
    }
    std::vector<std::string> inputs;
    for (std::size_t j = 0; j < nominal.chain.joints.size(); ++j) {
      const bool turns = nominal.chain.joints[j].type == JointType::revolute;
      inputs.push_back(fmt::format("q{}_{}", j + 1, turns ? "rad" : "mm"));
    }
    robot.correction = fit(poses.joints, error).model.named(inputs, {"dz_mm", "dx_mm", "dry_rad", "drx_rad"});
    EXPECT_LT(compare(robot, nominal, random_poses(nominal.chain, 100, 9), false), bound_ulp);
  }
}

Robot with_mimic(Robot robot, std::size_t joint, const Mimic& mimic) {
  robot.chain.joints[joint].mimic = mimic;
  return robot;
}

// Six drives that move seven joints: steps reach whole poses, to what compensate() calls reached.
TEST_F(RobotCSource, TakesTheValuesOfDrivesWhereJointsMimicOthers) {
  const Robot nominal =
      with_mimic(with_masses(seven_axes()), 3, {.joint = "joint2", .multiplier = -0.7, .offset = 20.0});
  CorrectedRobot robot{.robot = perturbed(nominal, 0.5, 0.03, 3), .correction = {}};
  robot.robot.chain.base = nominal.chain.base;
  robot.robot.effects = {{.type = "joint_compliance", .at = "joint4", .values = {5e-6}},
                         {.type = "transmission_error", .at = "joint4", .values = {3e-4, 2e-4}, .constants = {2.0}},
                         {.type = "eccentricity", .at = "joint2", .values = {3e-4, 2e-4}}};
  Poses poses = random_poses(nominal.chain, 200, 5);
  poses.joints = with_mimics(nominal.chain, poses.joints);
  EXPECT_LT(compare(robot, nominal, poses, false), bound_ulp);
  expect_steps_reach(robot, nominal, poses);
}

// A slide that follows a turning joint, and a turning joint that follows a slide.
TEST_F(RobotCSource, SlidesMayMimicTurnsAndTurnsSlides) {
  for (const auto& [joint, mimic] :
       std::vector<std::pair<std::size_t, Mimic>>{{2, {.joint = "joint2", .multiplier = 60.0, .offset = 100.0}},
                                                  {1, {.joint = "joint3", .multiplier = 0.01, .offset = -30.0}}}) {
    const Robot nominal = with_mimic(with_masses(scara()), joint, mimic);
    CorrectedRobot robot{.robot = nominal, .correction = {}};
    robot.robot.effects = {{.type = "joint_gain", .at = "joint2", .values = {1e-3}}};
    Poses poses = random_poses(nominal.chain, 100, 8);
    poses.joints = with_mimics(nominal.chain, poses.joints);
    EXPECT_LT(compare(robot, nominal, poses, false), bound_ulp);
    expect_steps_reach(robot, nominal, poses);
  }
}

TEST_F(RobotCSource, EffectsThatAreNoChangeOfAJointAreRefusedByName) {
  CorrectedRobot robot{.robot = with_masses(ur_like()), .correction = {}};
  robot.robot.effects = {{.type = "axis_wobble", .at = "joint2", .values = {1e-4, 0.0, 0.0, 0.0}}};
  try {
    to_c(robot, "arm", "arm.h");
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("axis_wobble@joint2"), std::string::npos);
  }
  EXPECT_THROW(to_c({ur_like(), {}}, "a name", "arm.h"), std::invalid_argument);
}

}  // namespace
}  // namespace llmt::robotics
