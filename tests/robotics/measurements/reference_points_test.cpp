#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "kinematics/rotations.hpp"
#include "llmt/random.hpp"
#include "llmt/robotics/calibration.hpp"
#include "llmt/robotics/orientation.hpp"
#include "measurements/drift.hpp"
#include "robotics/robots.hpp"

namespace llmt::robotics {
namespace {

const std::vector<Eigen::Vector3d> nests = {{1500, 300, -200}, {1700, -900, -150}, {400, -1300, 500}, {900, 800, 900}};

// A frame that settles: turned about a slanted axis, and shifted.
Pose moved_frame(double share) {
  Pose pose;
  pose.rotation = Eigen::AngleAxisd(2e-4 * share, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  pose.position_mm = share * Eigen::Vector3d(0.2, -0.1, 0.05);
  return pose;
}

std::vector<ReferenceReading> round_at(double when, const Pose& pose, double sigma_mm, Random& random) {
  std::vector<ReferenceReading> round;
  for (std::size_t i = 0; i < nests.size(); ++i) {
    const Eigen::Vector3d noise(random.normal(), random.normal(), random.normal());
    round.push_back({.point = fmt::format("nest{}", i),
                     .when = when,
                     .position_mm = pose.rotation * nests[i] + pose.position_mm + sigma_mm * noise,
                     .line = static_cast<Eigen::Index>(10.0 * when) + std::ssize(round)});
  }
  return round;
}

TEST(Drift, OfExactReadingsIsTakenBackBetweenRounds) {
  Random random(1);
  std::vector<std::vector<ReferenceReading>> rounds;
  for (const double when : {2.0, 5.0, 9.0}) rounds.push_back(round_at(when, moved_frame(when), 0.0, random));
  const Drift drift(rounds);
  EXPECT_TRUE(drift.turns());
  EXPECT_LT(drift.p_value(), 1e-6);
  const Eigen::Vector3d point(700.0, 200.0, 1100.0);
  const auto seen = [&](double when) {
    const Pose pose = moved_frame(when);
    return Eigen::Vector3d(pose.rotation * point + pose.position_mm);
  };
  for (const double when : {2.0, 3.1, 5.0, 8.0, 9.0}) {
    const Pose back = drift.to_first_round(when);
    EXPECT_LT((back.rotation * seen(when) + back.position_mm - seen(2.0)).norm(), 1e-4) << when;
  }
  // Before the first and after the last round it rests.
  EXPECT_LT((drift.to_first_round(0.0).position_mm - drift.to_first_round(2.0).position_mm).norm(), 1e-12);
  EXPECT_LT((drift.to_first_round(50.0).position_mm - drift.to_first_round(9.0).position_mm).norm(), 1e-12);
}

// An instrument at rest: p values below 1 % in 1 % of the files. Of 400, more than 12 come less than once in a
// thousand times (binomial). The estimated variance is unbiased; its mean over 400 files of 45 degrees of freedom has a
// standard error of sqrt(2 / 45 / 400) = 1.05 %.
TEST(Drift, AtRestIsClaimedAsOftenAsTheTestSays) {
  Random random(2);
  int claims = 0;
  double variance = 0.0;
  constexpr int files = 400;
  constexpr double sigma = 0.01;
  for (int file = 0; file < files; ++file) {
    std::vector<std::vector<ReferenceReading>> rounds;
    for (int k = 0; k < 6; ++k) rounds.push_back(round_at(k, Pose{}, sigma, random));
    const Drift drift(rounds);
    if (drift.p_value() < 0.01) ++claims;
    variance += *drift.scatter_mm() * *drift.scatter_mm() / files;
  }
  EXPECT_LE(claims, 12);
  EXPECT_NEAR(variance / (sigma * sigma), 1.0, 0.04);
}

TEST(Drift, NamesAPointThatWasMoved) {
  Random random(3);
  std::vector<std::vector<ReferenceReading>> rounds;
  for (int k = 0; k < 8; ++k) rounds.push_back(round_at(k, moved_frame(k), 0.005, random));
  rounds[4][2].position_mm.x() += 0.5;
  const Drift drift(rounds);
  ASSERT_FALSE(drift.strays().empty());
  EXPECT_EQ(drift.strays().front().line, rounds[4][2].line);
  rounds[4][2].position_mm.x() -= 0.5;
  EXPECT_TRUE(Drift(rounds).strays().empty());
}

TEST(Drift, OfTwoPointsIsAShift) {
  const auto round = [](double when, double x) {
    return std::vector<ReferenceReading>{{.point = "a", .when = when, .position_mm = {x, 0, 0}},
                                         {.point = "b", .when = when, .position_mm = {x + 100, 0, 0}}};
  };
  const Drift drift({round(0, 0), round(1, 0.3)});
  EXPECT_FALSE(drift.turns());
  EXPECT_NEAR(drift.to_first_round(0.5).position_mm.x(), -0.15, 1e-12);
  EXPECT_EQ(drift.to_first_round(0.5).rotation, Eigen::Matrix3d::Identity());
}

// A measured file of an arm, with a round of nests before every `step` poses and after the last one.
struct DriftingFile {
  std::string text;
  Eigen::MatrixXd still;  // what a resting instrument would have read
};

DriftingFile drifting_file(const Robot& robot, double size, double sigma_mm, bool orientations = false) {
  Random random(4);
  const int count = 60;
  const Poses poses = random_poses(robot.chain, count, 5);
  const std::vector<Pose> tools = tool_poses(robot, poses);
  DriftingFile file{.text = "order,q1_rad,q2_rad,q3_rad,q4_rad,q5_rad,q6_rad,x_mm,y_mm,z_mm,qw,qx,qy,qz,reference\n",
                    .still = Eigen::MatrixXd(count, 3)};
  if (!orientations) file.text = "order,q1_rad,q2_rad,q3_rad,q4_rad,q5_rad,q6_rad,x_mm,y_mm,z_mm,reference\n";
  const auto cells = [](const auto& values) {
    std::string text;
    for (const double value : values) text += fmt::format("{},", value);
    return text;
  };
  for (int i = 0; i <= count; ++i) {
    const Pose frame = moved_frame(size * i / count);
    if (i % 12 == 0) {
      for (const ReferenceReading& reading : round_at(i, frame, sigma_mm, random)) {
        file.text +=
            fmt::format("{},,,,,,,{}{}{}\n", i, cells(reading.position_mm), orientations ? ",,,," : "", reading.point);
      }
    }
    if (i == count) break;
    const Eigen::Vector3d noise(random.normal(), random.normal(), random.normal());
    file.still.row(i) = (tools[i].position_mm + sigma_mm * noise).transpose();
    const Eigen::Vector3d point = frame.rotation * file.still.row(i).transpose() + frame.position_mm;
    const Orientation turned = to_orientation({frame.rotation * tools[i].rotation}, "");
    file.text += fmt::format("{},", i) + cells(poses.joints.row(i)) + cells(point);
    file.text += (orientations ? cells(turned.values.row(0)) : "") + "\n";
  }
  return file;
}

TEST(ReferencePoints, TakeTheDriftOffPointsAndOrientations) {
  const Robot robot = ur_like();
  const DriftingFile file = drifting_file(robot, 1.0, 0.0, true);
  const Measurements m = parse_measurements(file.text, "m.csv", robot);
  ASSERT_EQ(m.count(), file.still.rows());
  EXPECT_LT((m.positions_mm - file.still).cwiseAbs().maxCoeff(), 1e-5);
  const std::vector<Eigen::Matrix3d> turned = rotations_of(m.orientation, "");
  const std::vector<Pose> tools = tool_poses(robot, m.poses);
  for (std::size_t i = 0; i < turned.size(); ++i) EXPECT_LT((turned[i] - tools[i].rotation).norm(), 1e-7) << i;
  // 0.23 mm of shift and 0.2 mrad at about 1 m.
  ASSERT_EQ(m.warnings.size(), 1u);
  EXPECT_NE(m.warnings[0].words({}).find("in 6 rounds is taken off: up to 0."), std::string::npos)
      << m.warnings[0].words({});
  EXPECT_EQ(m.lines.front(), 6);
  EXPECT_EQ(m.lines[12], 22);
}

TEST(ReferencePoints, LeaveAnInstrumentAtRestAlone) {
  const Robot robot = ur_like();
  const DriftingFile file = drifting_file(robot, 0.0, 0.01);
  const Measurements m = parse_measurements(file.text, "m.csv", robot);
  EXPECT_LT((m.positions_mm - file.still).cwiseAbs().maxCoeff(), 1e-12);
  ASSERT_EQ(m.warnings.size(), 1u);
  EXPECT_NE(m.warnings[0].words({}).find("no drift of the instrument (they scatter by 0.0"), std::string::npos)
      << m.warnings[0].words({});
}

TEST(ReferencePoints, ThatCannotBeUsedAreNamed) {
  const Robot robot = make_robot(Convention::dh, {{0, 300, 0, 0}});
  const std::string header = "q1_deg,x_mm,y_mm,z_mm,reference\n";
  const auto message = [&](const std::string& text) {
    try {
      return parse_measurements(text, "m.csv", robot).warnings.at(0).words({});
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
  };
  EXPECT_EQ(
      message(header + ",1,2,3,a\n5,2,3,4,\n"),
      "m.csv: the reference points were read in one round only, which shows no drift: read them again at the end");
  EXPECT_TRUE(message(header + ",1,2,3,a\n5,2,3,4,\n,1,2,3,b\n").starts_with("m.csv:4: reference point \"b\""));
  EXPECT_TRUE(message(header + ",1,,3,a\n5,2,3,4,\n").starts_with("m.csv:2: column \"y_mm\""));
  EXPECT_TRUE(message(header + ",1,2,3,a\n5,2,nix,4,\n").starts_with("m.csv:3: column \"y_mm\""));
  EXPECT_TRUE(message(header + ",1,2,3,a\n").starts_with("m.csv: there are no measured points"));
}

// Errors of the arm on fresh poses, whatever the base: the mean distance after the best motion of all points. The
// readings of the nests have the noise of those of the arm, so what is taken off has noise, too.
TEST(ReferencePoints, MakeACalibrationNearlyAsGoodAsWithoutDrift) {
  const Robot robot = ur_like();
  const DriftingFile file = drifting_file(robot, 1.0, 0.01);
  const Measurements measured = parse_measurements(file.text, "m.csv", robot);
  Measurements still = measured;
  still.positions_mm = file.still;
  Measurements drifting = measured;
  for (Eigen::Index row = 0; row < still.count(); ++row) {
    const Pose frame = moved_frame(static_cast<double>(row) / static_cast<double>(still.count()));
    drifting.positions_mm.row(row) = (frame.rotation * file.still.row(row).transpose() + frame.position_mm).transpose();
  }
  const Eigen::MatrixXd truth = positions(robot, random_poses(robot.chain, 200, 6));
  const auto error = [&](const Measurements& m) {
    const Eigen::MatrixXd reached = positions(calibrate(robot, m).robot, random_poses(robot.chain, 200, 6));
    const Pose base = kabsch(reached, truth);
    const Eigen::MatrixXd moved = (reached * base.rotation.transpose()).rowwise() + base.position_mm.transpose();
    return (moved - truth).rowwise().norm().mean();
  };
  EXPECT_LT(error(measured), 1.5 * error(still));
  EXPECT_LT(error(measured), 0.25 * error(drifting));
}

}  // namespace
}  // namespace llmt::robotics
