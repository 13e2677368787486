#include "llmt/robotics/pose_selection.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "llmt/robotics/robot_file.hpp"
#include "robotics/effects.hpp"
#include "robotics/robots.hpp"

namespace llmt::robotics {
namespace {

Robot shipped(const std::string& name) { return read_robot(std::string(LLMT_ROBOTS_DIR "/") + name + ".yaml"); }

double predicted_error(const PredictedCalibration& predicted, const std::string& name) {
  for (const auto& parameter : predicted.parameters) {
    if (parameter.name == name) return parameter.standard_error;
  }
  return 0.0;
}

// The prediction against calibrations: over 60 draws of noise the mean square of an error of the tool is known to one
// part in sqrt(2 / (60 * 27)), 3.5 %, and the mean of the squares of 60 errors of a parameter to 18 %: 4 sigma.
TEST(PoseSelection, PredictsWhatCalibrationsReach) {
  const Robot robot = shipped("tx200_like");
  const PosePlan plan{.candidates = {}, .measured = {}, .use = random_poses(robot, 200, {}, 5)};
  const PoseSelection selection = select_poses(robot, plan, {.count = 25, .noise_mm = 0.02});
  double square = 0.0;
  double of_parameter = 0.0;
  constexpr int draws = 60;
  const Eigen::MatrixXd truth = positions(robot, plan.use);
  for (int draw = 0; draw < draws; ++draw) {
    const Calibration calibration =
        calibrate(robot, measure(robot, selection.poses, 0.02, static_cast<std::uint64_t>(draw) + 1));
    square += (positions(calibration.robot, plan.use) - truth).rowwise().squaredNorm().mean() / draws;
    of_parameter += std::pow(calibration.robot.chain.joints[2].a_mm - robot.chain.joints[2].a_mm, 2) / draws;
  }
  EXPECT_NEAR(std::sqrt(square) / selection.chosen.position_mm, 1.0, 4 * 0.5 * 0.035 + 0.01);
  EXPECT_NEAR(std::sqrt(of_parameter) / predicted_error(selection.chosen, "joint3.a"), 1.0, 4 * 0.5 * 0.18);
}

TEST(PoseSelection, StaysWithinLimitsAndBoxAndBeatsRandomPoses) {
  const Robot robot = shipped("iiwa7");
  const ToolBox box{{300.0, -200.0, 200.0}, {600.0, 200.0, 600.0}};
  Robot base_moved = robot;
  base_moved.chain.base = {{1000.0, 0.0, 0.0}, {0.0, 0.0, 90.0}};  // the box goes with the base
  const PoseSelection selection = select_poses(base_moved, {}, {.count = 20, .box = box});
  const Eigen::MatrixXd tool = positions(robot, selection.poses);
  for (Eigen::Index i = 0; i < 20; ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_GE(tool(i, axis), box.lower_mm(axis) - 1e-9);
      EXPECT_LE(tool(i, axis), box.upper_mm(axis) + 1e-9);
    }
    for (std::size_t j = 0; j < robot.chain.joints.size(); ++j) {
      EXPECT_LE(std::abs(selection.poses.joints(i, j)) / degree, robot.chain.joints[j].limits->at(1) + 1e-9);
    }
  }
  EXPECT_LT(1.1 * selection.chosen.position_mm, selection.random.position_mm);
  EXPECT_LE(selection.bound_mm, selection.chosen.position_mm);
  EXPECT_GT(selection.bound_mm, 0.85 * selection.chosen.position_mm);
}

TEST(PoseSelection, IsTheSameForTheSameSeed) {
  const Robot robot = shipped("planar_two_link");
  const PoseSelectionOptions options{.count = 8};
  EXPECT_EQ(select_poses(robot, {}, options).poses.joints, select_poses(robot, {}, options).poses.joints);
}

TEST(PoseSelection, TakesGivenCandidatesAsTheyAreAndAddsToMeasuredOnes) {
  const Robot robot = ur_like();
  PosePlan plan;
  plan.candidates = random_poses(robot.chain, 80, 1);
  plan.candidates.covariates["pose"] = Eigen::VectorXd::LinSpaced(80, 0.0, 79.0);
  const PoseSelection alone = select_poses(robot, plan, {.count = 12});
  for (Eigen::Index i = 0; i < 12; ++i) {
    const auto number = static_cast<Eigen::Index>(std::lround(alone.poses.covariates.at("pose")(i)));
    EXPECT_EQ(alone.poses.joints.row(i), plan.candidates.joints.row(number));
  }
  plan.measured = random_poses(robot.chain, 12, 2);
  const PoseSelection more = select_poses(robot, plan, {.count = 12});
  EXPECT_LT(more.chosen.position_mm, alone.chosen.position_mm);
  EXPECT_NE(more.poses.joints, alone.poses.joints);
}

// A robot of a UR's kind: from positions 27 parameters can be told apart.
TEST(PoseSelection, CountsParametersAsCalibrationDoes) {
  const Robot robot = ur_like();
  const PoseSelection selection = select_poses(robot, {}, {.count = 15});
  const Calibration calibration = calibrate(robot, measure(robot, selection.poses, 0.01, 1));
  EXPECT_EQ(std::ssize(selection.chosen.parameters), calibration.result.rank);
  EXPECT_EQ(selection.fixed.size(), calibration.fixed.size());
}

TEST(PoseSelection, EffectsWhoseColumnsAreNotThereAreTakenAsKnown) {
  Robot robot = shipped("planar_two_link");
  robot.effects = {make_effect(effect_type("joint_compliance"), robot.chain, 0),
                   make_effect(effect_type("backlash_approach"), robot.chain, 1)};
  const PoseSelection selection = select_poses(robot, {}, {.count = 10});
  EXPECT_EQ(selection.left_out, std::vector<std::string>{"backlash_approach@joint2"});
}

TEST(PoseSelection, RefusesWhatCannotBe) {
  const Robot robot = shipped("tx200_like");
  const auto message = [&](const PosePlan& plan, const PoseSelectionOptions& options) -> std::string {
    try {
      select_poses(robot, plan, options);
    } catch (const std::exception& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(message({}, {.count = 6}).find("27 parameters need at least 9 poses"), std::string::npos)
      << message({}, {.count = 6});
  EXPECT_NE(message({}, {.count = 0}).find("count is 0"), std::string::npos);
  EXPECT_NE(message({}, {.noise_mm = 0.0}).find("noise_mm"), std::string::npos);
  EXPECT_NE(message({}, {.spacing_deg = -1.0}).find("spacing_deg"), std::string::npos);
  const ToolBox far{{9000.0, 0.0, 0.0}, {9100.0, 100.0, 100.0}};
  EXPECT_NE(message({}, {.box = far}).find("no pose within the joint limits"), std::string::npos);
  const ToolBox empty{{1.0, 0.0, 0.0}, {0.0, 1.0, 1.0}};
  EXPECT_NE(message({}, {.box = empty}).find("box"), std::string::npos);
  const PosePlan few{.candidates = random_poses(robot, 10, {}, 1), .measured = {}, .use = {}};
  EXPECT_NE(message(few, {.count = 20}).find("10 candidates"), std::string::npos);
  Robot slides = scara();
  EXPECT_THROW(select_poses(slides), std::invalid_argument);
  slides.chain.joints[2].limits = {0.0, 200.0};
  EXPECT_EQ(select_poses(slides, {}, {.count = 12}).poses.count(), 12);
}

}  // namespace
}  // namespace llmt::robotics
