// Poses along a path, which are dealt as stretches.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "llmt/robotics/calibration_report.hpp"
#include "robotics/observations.hpp"

namespace llmt::robotics {
namespace {

// A smooth motion of all joints, sampled densely; `points` of them.
Poses along_path(Eigen::Index points) {
  Poses poses;
  poses.joints.resize(points, 6);
  for (Eigen::Index i = 0; i < points; ++i) {
    const double t = static_cast<double>(i) / static_cast<double>(points);
    for (int j = 0; j < 6; ++j) poses.joints(i, j) = std::sin(2.0 * std::numbers::pi * (1.0 + 0.3 * j) * t + j);
  }
  return poses;
}

TEST(Path, StretchesStayTogether) {
  const std::vector<double> labels = pose_labels(along_path(400));
  ASSERT_EQ(labels.size(), 400U);
  EXPECT_EQ(std::set<double>(labels.begin(), labels.end()).size(), 25U);
  EXPECT_TRUE(std::ranges::is_sorted(labels));
  EXPECT_TRUE(path_of(random_poses(ur_like().chain, 400, 1)).empty());
  EXPECT_TRUE(path_of(along_path(40)).empty());
}

TEST(Path, OrientationsOfAPoseStayWithIt) {
  Poses poses = along_path(100);
  const Poses once = poses;
  poses.joints.resize(200, 6);
  poses.joints << once.joints, once.joints;
  poses.observations.resize(200);
  for (Eigen::Index i = 0; i < 200; ++i) poses.observations[i].stand = i % 100;
  const std::vector<double> labels = pose_labels(poses);
  ASSERT_EQ(labels.size(), 200U);
  for (std::size_t i = 0; i < 100; ++i) EXPECT_EQ(labels[i], labels[i + 100]) << i;
}

// A drift of the instrument along the path is no error of the arm that neighbours could foretell.
TEST(Path, HeldOutErrorsAreThoseOfStretchesThatWereNotSeen) {
  const Robot truth = perturbed(ur_like(), 0.3, 0.05, 3);
  Measurements seen = measure(truth, along_path(400), 0.02, 5);
  for (Eigen::Index i = 0; i < 400; ++i) seen.positions_mm(i, 2) += 0.3 * std::sin(0.05 * static_cast<double>(i));
  const CalibrationReport dealt = report_calibration(ur_like(), seen, {.correct = true});
  Measurements shuffled = seen;
  const std::vector<Eigen::Index> order = Random(1).permutation(400);
  shuffled = select(seen, order);
  const CalibrationReport mixed = report_calibration(ur_like(), shuffled, {.correct = true});
  EXPECT_TRUE(dealt.grouped);
  EXPECT_FALSE(mixed.grouped);
  EXPECT_GT(dealt.corrected->held_out_mm.mean(), 1.2 * mixed.corrected->held_out_mm.mean());
}

}  // namespace
}  // namespace llmt::robotics
