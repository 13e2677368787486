// The exported robot, compiled and run, against the library.
#include "llmt/robotics/robot_c_source.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <map>

#include "llmt/fit.hpp"
#include "llmt/robotics/compensation.hpp"
#include "oracles/thrown.hpp"
#include "robotics/effects.hpp"
#include "robotics/exported_robot.hpp"

namespace llmt::robotics {
namespace {

using oracle::Rows;

class RobotCSource : public ExportedRobot {
 protected:
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
    const Compensation found = compensate(robot, targets);
    for (Eigen::Index i = 0; i < poses.count(); ++i) {
      if (!same_commands || found.outcomes[i] != Outcome::reached) continue;
      EXPECT_LT((out.row(i).tail(joints) - found.commands.joints(i, drives)).norm(), 1e-9) << i;
    }
    return apart(robot, poses, out);
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

TEST_F(RobotCSource, ASumOfTreesIsThatOfTheLibrary) {
  const Robot nominal = with_masses(mdh_like());
  CorrectedRobot robot{.robot = nominal, .correction = {}};
  const Poses poses = random_poses(nominal.chain, 300, 8);
  TrainingData data{.inputs = poses.joints, .outputs = Eigen::MatrixXd(300, 2)};
  data.outputs.col(0) = (poses.joints.col(0) + poses.joints.col(1)).array().sin();
  data.outputs.col(1) = 1e-3 * poses.joints.col(2).array().cos();
  data.input_names = {"q1_rad", "q2_rad", "q3_rad", "q4_rad", "q5_rad", "q6_rad"};
  data.output_names = {"dz_mm", "dry_rad"};
  robot.correction = fit_boosted(data, {.max_rounds = 40}).model;
  EXPECT_LT(compare(robot, nominal, random_poses(nominal.chain, 100, 9), false), bound_ulp);
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

// Types that are not exported, and the reason that is given.
const std::map<std::string, std::string> not_exported = {
    {"joint_compliance_free_masses", "it needs the orientation of every body"},
    {"link_bending", "it displaces a link"},
    {"link_bending_no_carry_over", "it displaces a link"},
    {"link_torsion", "it displaces a link"},
    {"link_thermal_growth", "it displaces a link"},
    {"elastic_base", "it displaces the whole arm"},
    {"elastic_base_two", "it displaces the whole arm"},
    {"thermal_growth", "it displaces the whole arm"},
    {"base_thermal_drift", "it displaces the whole arm"},
    {"payload_error", "it changes the payload or the gravity that other effects are evaluated with"},
    {"gravity_tilt", "it changes the payload or the gravity that other effects are evaluated with"},
    {"axis_wobble", "it tilts the axis of a joint"},
    {"axis_wobble_at", "it tilts the axis of a joint"},
    {"drift", "it is an error of the measurement, not of the arm"},
    {"drift_curved", "it is an error of the measurement, not of the arm"},
    {"drift_settling", "it is an error of the measurement, not of the arm"},
    {"tracker_knock", "it is an error of the measurement, not of the arm"},
    {"instrument_azimuth", "it is an error of the measurement, not of the arm"},
    {"instrument_azimuth_twice", "it is an error of the measurement, not of the arm"},
    {"instrument_elevation", "it is an error of the measurement, not of the arm"},
    {"instrument_range", "it is an error of the measurement, not of the arm"},
    {"formula", "the user's expressions are not translated to C"}};

// An effect of the type at every joint that it suits, of some times its usual size.
Robot with_effects_of(const EffectType& type, Robot robot) {
  Random random(13);
  const std::size_t places = type.place == EffectPlace::robot ? 1 : robot.chain.joints.size();
  for (std::size_t index = 0; index < places; ++index) {
    if (!suits(type, robot.chain, index)) continue;
    Effect effect = make_effect(type, robot.chain, index, {}, 5);
    const std::vector<EffectParameter> parameters = effect_parameters(robot.chain, effect);
    for (std::size_t k = 0; k < parameters.size(); ++k) effect.values[k] = parameters[k].scale * random.uniform(0.5, 3);
    robot.effects.push_back(effect);
  }
  return robot;
}

// An arm that turns and slides, and bears loads about all axes.
TEST_F(RobotCSource, EveryTypeIsExportedAsTheLibraryHasItOrRefusedWithItsReason) {
  const Robot arm = slanted(weighted(scara()));
  const Poses poses = furnished_poses(arm.chain, 200, 17);
  for (const EffectType& type : effect_types()) {
    const auto reason = not_exported.find(type.name);
    if (reason == not_exported.end()) {
      const CorrectedRobot robot{.robot = with_effects_of(type, arm), .correction = {}};
      EXPECT_GE(robot.robot.effects.size(), 1U) << type.name;
      EXPECT_LT(forward_apart(robot, poses), bound_ulp) << type.name;
      continue;
    }
    CorrectedRobot robot{.robot = arm, .correction = {}};
    if (type.name == "formula") {
      robot.robot.effects = {{.type = "formula",
                              .at = "joint1",
                              .values = {1e-4},
                              .formula = {"own", {{"joint", "q1", "a", "rad", 1.0}}}}};
    } else {
      robot.robot.effects = {with_effects_of(type, arm).effects.at(0)};
    }
    EXPECT_EQ(oracle::thrown<std::invalid_argument>([&] { to_c(robot, "arm", "arm.h"); }),
              fmt::format("llmt::robotics::to_c: effect {} cannot be exported: {}. Effects that change a joint's value "
                          "can.",
                          effect_label(robot.robot.effects[0]), reason->second));
  }
}

TEST_F(RobotCSource, ANameMustBeAnIdentifierOfC) {
  EXPECT_THROW(to_c({ur_like(), {}}, "a name", "arm.h"), std::invalid_argument);
}

}  // namespace
}  // namespace llmt::robotics
