#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "llmt/robotics/discovery/discovery.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"
#include "robotics/observations.hpp"

namespace llmt::robotics {
namespace {

using discovery::Answer;

// A cell: three targets in one session, one in another.
Robot cell(std::uint64_t seed) {
  Robot robot = read_robot(LLMT_ROBOTS_DIR "/tx200_like.yaml");
  robot.effects.clear();
  Random random(seed);
  for (Joint& joint : robot.chain.joints) {
    joint.a_mm += 0.3 * random.normal();
    joint.d_mm += 0.3 * random.normal();
    joint.theta_deg += 0.02 * random.normal();
  }
  robot.chain.bases = {{"b", {.xyz_mm = {2000.0, 500.0, 100.0}, .rpy_deg = {0.0, 1.0, 120.0}}}};
  robot.chain.tools = {{"t2", {.xyz_mm = {150.0, 30.0, 90.0}}},
                       {"t3", {.xyz_mm = {-80.0, 130.0, 120.0}}},
                       {"b", {.xyz_mm = {20.0, -60.0, 200.0}}}};
  return robot;
}

Robot nominal() {
  Robot robot = read_robot(LLMT_ROBOTS_DIR "/tx200_like.yaml");
  robot.effects.clear();
  return robot;
}

Measurements seen_in_sessions(const Robot& truth, std::uint64_t seed) {
  const Poses first = simulate(nominal(), {.poses = 60, .noise_um = 0.0, .seed = seed}).poses;
  const Poses second = simulate(nominal(), {.poses = 50, .noise_um = 0.0, .seed = seed + 1}).poses;
  const Measurements three = read_off(truth, looked_at(first, {{}, {.tool = "t2"}, {.tool = "t3"}}), 0.02, seed + 2);
  return joined(three, read_off(truth, looked_at(second, {{.base = "b", .tool = "b"}}), 0.02, seed + 3));
}

Measurements seen_with_orientations(const Robot& truth, double noise_mrad, std::uint64_t seed) {
  const Poses poses = simulate(nominal(), {.poses = 120, .noise_um = 0.0, .seed = seed}).poses;
  Measurements seen = read_off(truth, poses, 0.02, seed + 1);
  Random random(seed + 2);
  std::vector<Eigen::Matrix3d> rotations;
  for (const Pose& tool : tool_poses(truth, poses)) {
    const Eigen::Vector3d turn(random.normal(), random.normal(), random.normal());
    rotations.emplace_back(Eigen::AngleAxisd(1e-3 * noise_mrad * turn.norm(), turn.normalized()) * tool.rotation);
  }
  seen.orientation.kind = Orientation::Kind::quaternion;
  seen.orientation.values.resize(poses.count(), 4);
  for (Eigen::Index i = 0; i < poses.count(); ++i) {
    const Eigen::Quaterniond q(rotations[i]);
    seen.orientation.values.row(i) << q.w(), q.x(), q.y(), q.z();
  }
  return with_orientations(seen, truth.chain);
}

std::vector<Measurements> all_kinds(const Robot& truth, std::uint64_t seed) {
  Robot plain = truth;
  plain.chain.bases.clear();
  plain.chain.tools.clear();
  return {seen_in_sessions(truth, seed), seen_with_orientations(plain, 0.03, seed),
          seen_with_orientations(plain, 0.3, seed)};
}

TEST(ObservationsDiscovery, NothingIsMissingWhereNothingIs) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    for (const Measurements& seen : all_kinds(cell(seed), 100 * seed)) {
      EXPECT_EQ(discover(nominal(), seen).answer, Answer::nothing_missing) << seed << " " << seen.count();
    }
  }
}

TEST(ObservationsDiscovery, TheHiddenEffectIsNamedAndAdded) {
  const std::vector<Effect> hidden = {{"joint_compliance", "joint2", {4e-7}, {}},
                                      {"eccentricity", "joint3", {2e-4, -1e-4}, {}}};
  for (const Effect& effect : hidden) {
    Robot truth = cell(9);
    truth.effects = {effect};
    for (const Measurements& seen : all_kinds(truth, 900)) {
      const Discovery found = discover(nominal(), seen);
      const bool is_named = found.answer == Answer::named || found.answer == Answer::indistinguishable;
      EXPECT_TRUE(is_named) << effect.type << " " << seen.count();
      EXPECT_TRUE(std::ranges::any_of(found.effects,
                                      [&](const FoundEffect& one) {
                                        return effect_label(one.effect) == effect_label(effect) ||
                                               std::ranges::find(one.rivals, effect_label(effect)) != one.rivals.end();
                                      }))
          << effect.type << " " << seen.count();
      // Noise of 0.02 mm in three coordinates is 0.032 mm long on average.
      EXPECT_LT(found.held_out.after.mean, 0.04) << effect.type << " " << seen.count();
      EXPECT_GT(found.held_out.before.mean, 0.06) << effect.type << " " << seen.count();
    }
  }
}

}  // namespace
}  // namespace llmt::robotics
