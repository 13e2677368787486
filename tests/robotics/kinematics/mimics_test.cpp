#include "kinematics/mimics.hpp"

#include <gtest/gtest.h>

#include "llmt/robotics/calibration.hpp"
#include "llmt/robotics/compensation.hpp"
#include "llmt/robotics/pose_selection.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"
#include "robotics/robots.hpp"

namespace llmt::robotics {
namespace {

// A palletizer: rods keep the forearm's angle apart from the upper arm's, and the flange level.
const std::string palletizer = R"(<robot name="palletizer">
<link name="base"/><link name="l1"/><link name="l2"/><link name="l3"/><link name="l4"/><link name="l5"/>
<link name="tip"/>
<joint name="turn" type="revolute"><parent link="base"/><child link="l1"/><origin xyz="0 0 0.8"/><axis xyz="0 0 1"/>
  <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="upper" type="revolute"><parent link="l1"/><child link="l2"/><origin xyz="0.3 0 0"/><axis xyz="0 1 0"/>
  <limit lower="-0.6" upper="1.4" effort="1" velocity="1"/></joint>
<joint name="rod" type="revolute"><parent link="l2"/><child link="l3"/><origin xyz="0 0 1.1"/><axis xyz="0 1 0"/>
  <limit lower="-1.2" upper="2" effort="1" velocity="1"/><mimic joint="upper" multiplier="-1" offset="0.1"/></joint>
<joint name="fore" type="revolute"><parent link="l3"/><child link="l4"/><origin xyz="0 0 0"/><axis xyz="0 1 0"/>
  <limit lower="-0.3" upper="1.9" effort="1" velocity="1"/></joint>
<joint name="level" type="revolute"><parent link="l4"/><child link="l5"/><origin xyz="1.2 0 0"/><axis xyz="0 1 0"/>
  <limit lower="-4" upper="4" effort="1" velocity="1"/><mimic joint="fore" multiplier="-1"/></joint>
<joint name="hand" type="revolute"><parent link="l5"/><child link="tip"/><origin xyz="0.2 0 -0.1"/><axis xyz="0 0 1"/>
  <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
</robot>)";

Robot arm() {
  return {.chain = parse_urdf(palletizer, "p.urdf"), .effects = {}, .identified = {}, .correction_file = ""};
}

TEST(Mimics, OfAUrdfKeepTheFlangeLevel) {
  const Robot robot = arm();
  ASSERT_EQ(robot.chain.joints.size(), 6);
  const Poses poses = simulate(robot, {.poses = 100, .noise_um = 0.0, .seed = 3}).poses;
  for (const Pose& pose : tool_poses(robot, poses)) {
    // The rod's offset of 0.1 rad tilts the flange by as much, always.
    EXPECT_NEAR(pose.rotation(2, 2), std::cos(0.1), 1e-12);
  }
  EXPECT_EQ(to_yaml(parse_robot(to_yaml(robot), "p.yaml")), to_yaml(robot));
}

TEST(Mimics, CountInTheUnitsOfTheirJoints) {
  const std::string text = R"(<robot name="r"><link name="a"/><link name="b"/><link name="c"/><link name="d"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint>
<joint name="k" type="prismatic"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/>
  <limit lower="-9" upper="9" effort="1" velocity="1"/><mimic joint="j" multiplier="0.2" offset="0.05"/></joint>
<joint name="l" type="continuous"><parent link="c"/><child link="d"/><axis xyz="1 0 0"/>
  <mimic joint="j" multiplier="2" offset="0.5"/></joint></robot>)";
  const Chain chain = parse_urdf(text, "r.urdf");
  const Eigen::MatrixXd joints = with_mimics(chain, Eigen::RowVector3d(1.5, 7.0, 7.0));
  EXPECT_NEAR(joints(0, 1), 350.0, 1e-10);
  EXPECT_NEAR(joints(0, 2), 3.5, 1e-12);
}

TEST(Mimics, NeedNoColumns) {
  const Robot robot = arm();
  const Measurements m =
      parse_measurements("turn_rad,upper_rad,fore_rad,hand_deg,x_mm,y_mm,z_mm\n0.5,0.2,0.3,90,1,2,3\n", "m.csv", robot);
  Eigen::RowVectorXd expected(6);
  expected << 0.5, 0.2, -0.1, 0.3, -0.3, std::acos(0.0);
  EXPECT_LT((m.poses.joints.row(0) - expected).norm(), 1e-14);
}

TEST(Mimics, MayFollowAJointThatComesLater) {
  Robot robot = arm();
  robot.chain.joints[0].mimic = Mimic{.joint = "hand", .multiplier = 0.5};
  EXPECT_EQ(to_yaml(parse_robot(to_yaml(robot), "p.yaml")), to_yaml(robot));
}

TEST(Mimics, AColumnThatContradictsThemIsRefused) {
  const Robot robot = arm();
  const auto read = [&](const std::string& rod) {
    try {
      parse_measurements(
          "turn_rad,upper_rad,rod_rad,fore_rad,hand_deg,x_mm,y_mm,z_mm\n0.5,0.2," + rod + ",0.3,90,1,2,3\n", "m.csv",
          robot);
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(read("-0.099"), "");
  EXPECT_EQ(read("0.4"),
            "m.csv:1: column \"rod_rad\": rod mimics upper, and the column is up to 28.6 deg off what it should then "
            "be; leave it out, or correct the description");
}

TEST(Mimics, NeedLimitsWithACommonValue) {
  // The upper arm's -34.38 ... 80.21 deg put the rod, at -upper + 5.73 deg, between -74.48 and 40.11 deg.
  const auto said_with = [](double low, double high) {
    Chain chain = arm().chain;
    chain.joints[joint_index(chain, "rod")].limits = {low, high};
    try {
      validate(chain);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const std::string none =
      "llmt::robotics::Chain: the limits of upper and of the joints that mimic it have no value in common";
  EXPECT_EQ(said_with(100.0, 200.0), none);
  EXPECT_EQ(said_with(40.2, 200.0), none);
  EXPECT_EQ(said_with(40.0, 200.0), "");
  EXPECT_EQ(said_with(-200.0, -74.4), "");
  EXPECT_EQ(said_with(-200.0, -74.6), none);
}

TEST(Mimics, AreKeptBySearchesOfJointValues) {
  const Robot nominal = arm();
  Robot truth = perturbed(nominal, 0.5, 0.05, 4);
  truth.chain.base = nominal.chain.base;
  const Poses poses = random_poses(nominal, 200, {}, 5);
  EXPECT_EQ(with_mimics(nominal.chain, poses.joints), poses.joints);
  EXPECT_LE(poses.joints.col(1).maxCoeff(), 1.3);  // beyond it the rod would leave its range
  const PoseSelection chosen = select_poses(nominal, {}, {.count = 20});
  EXPECT_EQ(with_mimics(nominal.chain, chosen.poses.joints), chosen.poses.joints);

  Targets targets;
  targets.start = poses;
  targets.positions_mm = positions(nominal, poses);
  const Compensation found = compensate(CorrectedRobot{.robot = truth, .correction = {}}, targets);
  EXPECT_GT(std::ranges::count(found.outcomes, Outcome::reached), 190);
  EXPECT_EQ(with_mimics(nominal.chain, found.commands.joints), found.commands.joints);
  // Four drives do not set an orientation.
  EXPECT_EQ(drive_count(nominal.chain), 4);
  for (const Pose& pose : tool_poses(nominal, poses)) targets.rotations.push_back(pose.rotation);
  EXPECT_EQ(compensate(CorrectedRobot{.robot = truth, .correction = {}}, targets).outcomes, found.outcomes);
}

TEST(Mimics, AreCalibratedWithTheRest) {
  const Robot truth = perturbed(arm(), 0.5, 0.05, 4);
  const Measurements measured = simulate(truth, {.poses = 80, .noise_um = 10.0, .seed = 6});
  const Measurements fresh = simulate(truth, {.poses = 200, .noise_um = 0.0, .seed = 7});
  const Calibration calibration = calibrate(arm(), measured);
  EXPECT_GT(distances(positions(arm(), fresh.poses), fresh).mean(), 0.5);
  EXPECT_LT(distances(positions(calibration.robot, fresh.poses), fresh).mean(), 0.01);
}

TEST(Mimics, OfNothingOrOfEachOtherAreRefused) {
  const auto refused = [](const std::string& joint, const std::string& mimic, double multiplier) {
    Chain chain = arm().chain;
    chain.joints[joint_index(chain, joint)].mimic = Mimic{.joint = mimic, .multiplier = multiplier};
    try {
      validate(chain);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(refused("hand", "finger", 1.0),
            "llmt::robotics::Chain: hand mimics \"finger\", which is no joint of the chain");
  EXPECT_EQ(refused("hand", "rod", 1.0), "llmt::robotics::Chain: hand mimics rod, which must have a drive of its own");
  EXPECT_EQ(refused("hand", "hand", 1.0),
            "llmt::robotics::Chain: hand mimics hand, which must have a drive of its own");
  EXPECT_EQ(refused("hand", "turn", 0.0), "llmt::robotics::Chain: hand: multiplier is 0, must be finite and not 0");
}

}  // namespace
}  // namespace llmt::robotics
