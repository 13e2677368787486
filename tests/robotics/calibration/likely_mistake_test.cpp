#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "llmt/robotics/calibration_report.hpp"
#include "robotics/robots.hpp"

namespace llmt::robotics {
namespace {

// What is said of a table after something has gone wrong in it.
std::string said_after(const std::function<void(Measurements&)>& wrong) {
  const Robot truth = perturbed(ur_like(), 0.3, 0.05, 3);
  Measurements seen = measure(truth, random_poses(truth.chain, 80, 4), 0.05, 5);
  wrong(seen);
  const CalibrationReport report = report_calibration(ur_like(), seen, {.folds = 0});
  std::string all;
  for (const std::string& suspicion : suspicions(ur_like(), seen, report)) all += suspicion + "\n";
  return all;
}

TEST(LikelyMistake, SignsZerosOrderAndAxesAreNamed) {
  const struct {
    std::function<void(Measurements&)> wrong;
    const char* said;
  } cases[] = {
      {[](Measurements& m) { m.poses.joints.col(1) *= -1.0; }, "joint2 counts in the other direction"},
      {[](Measurements& m) { m.poses.joints.col(3).array() += 90.0 * degree; }, "joint4 has its zero -90 deg away"},
      {[](Measurements& m) { m.poses.joints.col(1).swap(m.poses.joints.col(2)); },
       "columns of joint2 and joint3 are exchanged"},
      {[](Measurements& m) {
         const Eigen::MatrixXd q = m.poses.joints;
         for (int j = 0; j < 6; ++j) m.poses.joints.col(j) = q.col((j + 1) % 6);
       },
       "columns of the joints are shifted"},
      {[](Measurements& m) { m.positions_mm.col(1) *= -1.0; }, "axis of the instrument is reversed"},
      {[](Measurements& m) {
         m.poses.joints.col(1) *= -1.0;
         m.poses.joints.col(2) *= -1.0;
         m.poses.joints.col(5) *= -1.0;
       },
       "joint2, joint3, joint6 count in the other direction"},
  };
  for (const auto& one : cases) {
    const std::string said = said_after(one.wrong);
    EXPECT_NE(said.find("most likely"), std::string::npos) << one.said << "\n" << said;
    EXPECT_NE(said.find(one.said), std::string::npos) << said;
  }
  EXPECT_EQ(said_after([](Measurements&) {}).find("most likely"), std::string::npos);
}

}  // namespace
}  // namespace llmt::robotics
