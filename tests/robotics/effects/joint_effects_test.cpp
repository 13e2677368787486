// Effects of single joints against geometry and differential equations worked out by hand.
#include <gtest/gtest.h>

#include <complex>

#include "robotics/effects.hpp"

namespace llmt::robotics {
namespace {

using Eigen::Vector3d;

// Each pose must be where the rigid arm is with joint `joint` moved by what `error` says.
template <typename Error>
void expect_joint_error(const Robot& robot, const Effect& effect, std::size_t joint, const Poses& poses, Error error) {
  const Eigen::MatrixXd points = positions(with_effect(robot, effect), poses);
  for (Eigen::Index i = 0; i < poses.count(); ++i) {
    const Eigen::VectorXd q = poses.joints.row(i).transpose();
    const Vector3d expected = moved_tool(robot, q, joint, error(q, i));
    EXPECT_LT((points.row(i).transpose() - expected).norm(), 1e-7) << effect_label(effect) << " pose " << i;
  }
}

TEST(JointEffects, GainStretchesTheJointValue) {
  for (const std::size_t joint : {std::size_t{1}, std::size_t{2}}) {
    const Robot robot = scara();
    expect_joint_error(robot, {"joint_gain", robot.chain.joints[joint].name, {3e-4}}, joint,
                       random_poses(robot.chain, 5, 1),
                       [&](const Eigen::VectorXd& q, Eigen::Index) { return 3e-4 * q(joint); });
  }
}

// A disc whose centre lies off the axis: the mark at angle q on it, as seen from the axis.
TEST(JointEffects, EccentricityIsACircleSeenFromOffItsCentre) {
  const Robot robot = ur_like();
  const double radius = 40.0;
  for (const std::complex<double> centre :
       {std::complex(0.01, 0.0), std::complex(-0.02, 0.5), std::complex(3.0, -9.0)}) {
    const std::vector<double> values = {centre.imag() / radius, -centre.real() / radius};
    expect_joint_error(robot, {"eccentricity", "joint2", values}, 1, random_poses(robot.chain, 9, 2),
                       [&](const Eigen::VectorXd& q, Eigen::Index) {
                         const std::complex<double> mark = centre + std::polar(radius, q(1));
                         return std::arg(mark / std::polar(1.0, q(1)));
                       });
  }
}

TEST(JointEffects, PeriodicErrorsRepeatWithTheirOrder) {
  const Robot robot = ur_like();
  const auto wave = [](double order, std::size_t joint) {
    return [=](const Eigen::VectorXd& q, Eigen::Index) {
      const std::complex<double> coefficients(2e-4, -1e-4);  // Re((a - i b) e^{i n q})
      return (coefficients * std::polar(1.0, order * q(joint))).real();
    };
  };
  const Poses poses = random_poses(robot.chain, 5, 3);
  expect_joint_error(robot, {"eccentricity_twice", "joint3", {2e-4, 1e-4}}, 2, poses, wave(2.0, 2));
  expect_joint_error(robot, {"transmission_error", "joint4", {2e-4, 1e-4}, {202.0}}, 3, poses, wave(202.0, 3));
}

TEST(JointEffects, SeveralOrdersMayBeAtOneJoint) {
  Robot robot = ur_like();
  robot.effects = {{"transmission_error", "joint2", {1e-4, 0.0}, {2.0}},
                   {"transmission_error", "joint2", {0.0, 1e-4}, {202.0}}};
  EXPECT_NO_THROW(validate(robot));
  EXPECT_EQ(parameters(robot).back().name, "transmission_error@joint2[202].sine");
  robot.effects.push_back(robot.effects[1]);
  EXPECT_THROW(validate(robot), std::invalid_argument);
}

TEST(JointEffects, MapIsASumOfHats) {
  const std::vector<double> knots = {1e-3, -2e-3, 5e-4, 3e-3};
  const auto hats = [&](double at) {  // at in steps from the first knot
    double sum = 0.0;
    for (std::size_t k = 0; k < knots.size(); ++k) {
      const double away = at - static_cast<double>(k);
      const bool beyond = (k == 0 && away < 0.0) || (k + 1 == knots.size() && away > 0.0);
      sum += knots[k] * (beyond ? 1.0 : std::max(0.0, 1.0 - std::abs(away)));
    }
    return sum;
  };
  const Robot robot = scara();
  Poses poses = random_poses(robot.chain, 40, 4);
  poses.joints(0, 1) = -1.5;  // on knots, the first and the last
  poses.joints(1, 1) = -1.5 + 3 * 0.5;
  expect_joint_error(robot, {"joint_map", "joint2", knots, {-1.5, 0.5}}, 1, poses,
                     [&](const Eigen::VectorXd& q, Eigen::Index) { return hats((q(1) + 1.5) / 0.5); });
  expect_joint_error(robot, {"joint_map", "joint3", knots, {20.0, 50.0}}, 2, poses,
                     [&](const Eigen::VectorXd& q, Eigen::Index) { return hats((q(2) - 20.0) / 50.0); });
}

// Two points and a spring: the torque is minus the slope of its energy.
TEST(JointEffects, SpringTurnsTheJointByTheSlopeOfItsEnergy) {
  const Robot robot = ur_like();
  const double stiffness = 20.0;   // N/mm
  const double compliance = 1e-9;  // rad/(N mm)
  const std::complex<double> fixed = std::polar(300.0, 0.8);
  for (const double free_length : {0.0, 100.0}) {
    const double lever = 120.0;
    const double phase = 0.3;  // of the link's point at q = 0
    const auto energy = [&](double q) {
      const double length = std::abs(std::polar(lever, q + phase) - fixed);
      return 0.5 * stiffness * std::pow(length - free_length, 2);
    };
    const double size = compliance * stiffness * lever * std::abs(fixed);
    const double angle = phase - std::arg(fixed);
    const Effect spring = {"counterbalance_spring",
                           "joint2",
                           {-size * std::sin(angle), -size * std::cos(angle)},
                           {lever / std::abs(fixed), free_length / std::abs(fixed)}};
    expect_joint_error(robot, spring, 1, random_poses(robot.chain, 9, 5), [&](const Eigen::VectorXd& q, Eigen::Index) {
      return -compliance * (energy(q(1) + 1e-4) - energy(q(1) - 1e-4)) / 2e-4;
    });
  }
}

TEST(JointEffects, BacklashUnderGravityLiesWhereTheEnergyFalls) {
  for (const Robot& robot : {slanted(weighted(ur_like())), slanted(weighted(scara()))}) {
    const Poses poses = furnished_poses(robot.chain, 12, 6);
    for (const std::size_t joint : {std::size_t{1}, std::size_t{2}}) {
      expect_joint_error(robot, {"backlash_gravity", robot.chain.joints[joint].name, {2e-4}}, joint, poses,
                         [&](const Eigen::VectorXd& q, Eigen::Index i) {
                           const double load = gravity_by_energy(robot, q, column_of(poses, "payload_kg", i), joint);
                           return std::copysign(2e-4, load);
                         });
    }
  }
}

TEST(JointEffects, BacklashOfTheApproachLagsBehind) {
  const Robot robot = ur_like();
  const Poses poses = furnished_poses(robot.chain, 8, 7);
  expect_joint_error(
      robot, {"backlash_approach", "joint5", {1e-4}}, 4, poses,
      [&](const Eigen::VectorXd&, Eigen::Index i) { return column_of(poses, "dir5", i) > 0.0 ? -1e-4 : 1e-4; });
}

// Dahl: dz/dx = (1 - z sign(x)) / delta, from z = -sign(x), integrated in small steps.
TEST(JointEffects, HysteresisFollowsDahlsEquation) {
  const Robot robot = ur_like();
  Poses poses = random_poses(robot.chain, 6, 8);
  poses.covariates["move2_rad"] = (Eigen::VectorXd(6) << 0.0, 0.001, -0.004, 0.02, -0.1, 1.0).finished();
  const double delta = 0.01;
  expect_joint_error(robot, {"hysteresis", "joint2", {2e-4}, {delta}}, 1, poses,
                     [&](const Eigen::VectorXd&, Eigen::Index i) {
                       const double move = column_of(poses, "move2_rad", i);
                       if (move == 0.0) return 0.0;
                       const double way = move > 0.0 ? 1.0 : -1.0;
                       double wound = -way;
                       constexpr int steps = 200000;
                       const double dx = move / steps;
                       for (int k = 0; k < steps; ++k) {
                         const double half = wound + 0.5 * dx * (1.0 - wound * way) / delta;
                         wound += dx * (1.0 - half * way) / delta;
                       }
                       return -2e-4 * wound;
                     });
}

// A long move, then a short one in the direction of the approach: exp(-short / delta) of the state stays.
TEST(JointEffects, TheApproachTurnsHysteresisBack) {
  const Robot robot = ur_like();
  Poses poses = random_poses(robot.chain, 4, 8);
  poses.covariates["move2_rad"] = (Eigen::VectorXd(4) << 1.0, 1.0, -1.0, -0.02).finished();
  poses.covariates["dir2"] = (Eigen::VectorXd(4) << 1.0, -1.0, 1.0, 1.0).finished();
  const double delta = 0.01;
  const double stays = std::exp(-0.001 / delta);
  expect_joint_error(robot, {"hysteresis_approach", "joint2", {2e-4, 2e-4 * (1.0 - stays)}, {delta}}, 1, poses,
                     [&](const Eigen::VectorXd&, Eigen::Index i) {
                       const double move = column_of(poses, "move2_rad", i);
                       const double way = move > 0.0 ? 1.0 : -1.0;
                       const double wound = way * (1.0 - 2.0 * std::exp(-std::abs(move) / delta));
                       const double side = column_of(poses, "dir2", i);
                       return -2e-4 * (side + (wound - side) * stays);
                     });
}

TEST(JointEffects, CoupledAxisFollowsTheOneBefore) {
  const Robot robot = ur_like();
  expect_joint_error(robot, {"wrist_coupling", "joint5", {4e-4}}, 4, random_poses(robot.chain, 4, 9),
                     [](const Eigen::VectorXd& q, Eigen::Index) { return 4e-4 * q(3); });
  EXPECT_FALSE(suits(effect_type("wrist_coupling"), robot.chain, 0));
  EXPECT_THROW(validate(with_effect(robot, {"wrist_coupling", "joint1", {0.0}})), std::invalid_argument);
}

TEST(JointEffects, ReadBackOfShareOneIsTheTruth) {
  for (const Robot& robot : {ur_like(), scara()}) {
    const Poses poses = furnished_poses(robot.chain, 5, 10);
    const bool turns = robot.chain.joints[2].type == JointType::revolute;
    expect_joint_error(robot, {"read_back_lag", "joint3", {1.0}}, 2, poses,
                       [&](const Eigen::VectorXd& q, Eigen::Index i) {
                         return column_of(poses, turns ? "qmeas3_rad" : "qmeas3_mm", i) - q(2);
                       });
  }
}

// The side that stands still is the end of a shorter chain.
TEST(JointEffects, WobbleTurnsTheAxisAndAllBeyondIt) {
  const Robot robot = weighted(ur_like());
  const std::vector<double> values = {1e-4, -2e-4, 3e-4, 4e-4};
  for (std::size_t j = 0; j < 6; ++j) {
    const Poses poses = random_poses(robot.chain, 4, 11);
    const Eigen::MatrixXd points =
        positions(with_effect(robot, {"axis_wobble", robot.chain.joints[j].name, values}), poses);
    for (Eigen::Index i = 0; i < poses.count(); ++i) {
      const Eigen::VectorXd q = poses.joints.row(i).transpose();
      Chain shorter = robot.chain;
      shorter.tool = {};
      shorter.joints.resize(std::max<std::size_t>(j, 1));
      Eigen::VectorXd first = q.head(std::ssize(shorter.joints));
      if (j == 0) {  // a joint that does nothing stands for none
        shorter.joints[0] = Joint();
        shorter.joints[0].name = "none";
        first(0) = 0.0;
      }
      const Pose still = forward(shorter, first);
      const double c = std::cos(q(j));
      const double s = std::sin(q(j));
      const Vector3d turn =
          still.rotation * Vector3d(values[0] * c + values[1] * s, values[2] * c + values[3] * s, 0.0);
      const Vector3d tool = forward(robot.chain, q).position_mm;
      const Vector3d expected =
          still.position_mm + Eigen::AngleAxisd(turn.norm(), turn.normalized()) * (tool - still.position_mm);
      EXPECT_LT((points.row(i).transpose() - expected).norm(), 1e-9) << j;
    }
  }
}

}  // namespace
}  // namespace llmt::robotics
