#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "calibration/orientation_mistake.hpp"
#include "llmt/robotics/calibration_report.hpp"
#include "llmt/robotics/likely_mistake.hpp"
#include "llmt/robotics/orientation.hpp"
#include "robotics/observations.hpp"
#include "study.hpp"

namespace llmt::robotics {
namespace {

// What is said of a table after something has gone wrong in it.
std::string said_after(const std::function<void(Measurements&)>& wrong) {
  const Robot truth = perturbed(ur_like(), 0.3, 0.05, 3);
  Measurements seen = measure(truth, random_poses(truth.chain, 80, 4), 0.05, 5);
  wrong(seen);
  const std::optional<Suspicion> found = likely_mistake(ur_like(), seen);
  return found ? found->name + ": " + found->sentence : std::string();
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
      {[](Measurements& m) { m.poses.joints.col(2) /= degree; }, "the values of joint3 are degrees, not radians"},
      {[](Measurements& m) { m.poses.joints.col(4) *= degree; }, "the values of joint5 are radians, not degrees"},
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

TEST(LikelyMistake, TheOrderOfAnglesAndQuaternionsIsNamed) {
  const Robot truth = perturbed(ur_like(), 0.3, 0.05, 3);
  Measurements seen = measure(truth, random_poses(truth.chain, 40, 4), 0.05, 5);
  std::vector<Eigen::Matrix3d> rotations;
  for (const Pose& pose : tool_poses(truth, seen.poses)) rotations.push_back(pose.rotation);
  const auto said = [&](const std::string& written, const std::string& read) {
    Robot described = ur_like();
    described.chain.orientation = read;
    seen.orientation = to_orientation(rotations, written);
    const auto found = likely_orientation_mistake(described, with_orientations(seen, described.chain));
    return found ? found->name : std::string();
  };
  const std::vector<std::string> orders = {"xyz", "xzy", "yxz", "yzx", "zxy", "zyx"};
  for (std::size_t of_written = 0; of_written < orders.size(); ++of_written) {
    // Of the orders that are read, the gate takes one each: two are right, four are not.
    const std::size_t every = sampled(1, 6);
    for (std::size_t of_read = every > 1 ? (of_written * 5 + 2) % 6 : 0; of_read < orders.size(); of_read += every) {
      const std::string& written = orders[of_written];
      const std::string& read = orders[of_read];
      const std::string expected = written == read ? "" : "orientation_intrinsic_" + written;
      EXPECT_EQ(said("intrinsic_" + written, "intrinsic_" + read), expected) << written << " read as " << read;
    }
  }
  seen.orientation = to_orientation(rotations, "");
  const Eigen::MatrixXd first = seen.orientation.values;
  EXPECT_FALSE(likely_orientation_mistake(ur_like(), with_orientations(seen, ur_like().chain)));
  seen.orientation.values << first.rightCols(3), first.leftCols(1);
  EXPECT_EQ(likely_mistake(ur_like(), with_orientations(seen, ur_like().chain))->name, "orientation_w_last");
  for (Eigen::Matrix3d& own : rotations) own.transposeInPlace();
  seen.orientation = to_orientation(rotations, "");
  EXPECT_EQ(likely_orientation_mistake(ur_like(), with_orientations(seen, ur_like().chain))->name,
            "orientation_inverse");
}

// Mean angle, deg, by which rotations differ from their mean: the eigenvector of the sum of q q' (Markley et al. 2007).
double scatter_deg(const std::vector<Eigen::Matrix3d>& rotations) {
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  for (const Eigen::Matrix3d& own : rotations) {
    const Eigen::Quaterniond q(own);
    sum += q.coeffs() * q.coeffs().transpose();
  }
  const Eigen::Vector4d best = Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d>(sum).eigenvectors().col(3);
  const Eigen::Quaterniond mean(best);
  double angles = 0.0;
  for (const Eigen::Matrix3d& own : rotations) angles += mean.angularDistance(Eigen::Quaterniond(own));
  return angles / static_cast<double>(rotations.size()) / degree;
}

// Of few or widely scattered rotations the matrix nearest to all may be a reflection; the mean is a rotation all the
// same. Where orientations are read wrongly they scatter widely.
TEST(LikelyMistake, HowFarOrientationsScatterAsTheyAreReadIsSaid) {
  int reflections = 0;
  for (const std::uint64_t seed : {4, 5, 6}) {
    Measurements seen = measure(ur_like(), random_poses(ur_like().chain, 10, seed), 0.0, 5);
    std::vector<Eigen::Matrix3d> rotations;
    for (const Pose& pose : tool_poses(ur_like(), seen.poses)) rotations.push_back(pose.rotation);
    for (const std::string read : {"intrinsic_xzy", "intrinsic_yxz", "intrinsic_yzx", "intrinsic_zxy"}) {
      Robot described = ur_like();
      described.chain.orientation = read;
      seen.orientation = to_orientation(rotations, "intrinsic_xyz");
      std::vector<Eigen::Matrix3d> between = rotations_of(seen.orientation, read);
      Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
      for (std::size_t k = 0; k < between.size(); ++k) {
        between[k] = rotations[k].transpose() * between[k];
        sum += between[k];
      }
      reflections += sum.determinant() < 0.0 ? 1 : 0;
      const auto found = likely_orientation_mistake(described, with_orientations(seen, described.chain));
      ASSERT_TRUE(found) << read;
      const std::string before = "instead of ";
      const double said = std::stod(found->sentence.substr(found->sentence.find(before) + before.size()));
      EXPECT_NEAR(said, scatter_deg(between), 0.006 * said) << read << ", seed " << seed;
    }
  }
  EXPECT_GT(reflections, 0);
}

TEST(LikelyMistake, OfOrientationsTakesTenOfThem) {
  for (const Eigen::Index count : {9, 10}) {
    Measurements seen = measure(ur_like(), random_poses(ur_like().chain, count, 4), 0.0, 5);
    std::vector<Eigen::Matrix3d> rotations;
    for (const Pose& pose : tool_poses(ur_like(), seen.poses)) rotations.push_back(pose.rotation);
    seen.orientation = to_orientation(rotations, "intrinsic_xyz");
    Robot described = ur_like();
    described.chain.orientation = "intrinsic_zyx";
    const auto found = likely_orientation_mistake(described, with_orientations(seen, described.chain));
    EXPECT_EQ(found.has_value(), count == 10);
  }
}

TEST(LikelyMistake, TheUnitOfOneTargetIsNamed) {
  Robot truth = perturbed(ur_like(), 0.3, 0.05, 6);
  truth.chain.tools = {{"t2", {.xyz_mm = {-70.0, 80.0, 100.0}}}, {"t3", {.xyz_mm = {10.0, -90.0, 160.0}}}};
  Measurements seen =
      read_off(truth, looked_at(random_poses(truth.chain, 60, 7), {{}, {.tool = "t2"}, {.tool = "t3"}}), 0.05, 8);
  for (Eigen::Index i = 1; i < seen.count(); i += 3) seen.positions_mm.row(i) *= 0.001;
  const std::optional<Suspicion> said = likely_mistake(ur_like(), seen);
  ASSERT_TRUE(said);
  EXPECT_NE(said->sentence.find("the points of target \"t2\" are metres"), std::string::npos) << said->sentence;
}

// A joint of the wrist moves the tool by a hundredth of the arm's length: a mistake there is as bad, and as clear.
TEST(LikelyMistake, IsNamedAtTheWristHoweverSmallTheMisfit) {
  const auto expect = [](const std::function<void(Measurements&)>& wrong, const std::string& name) {
    const std::string said = said_after(wrong);
    EXPECT_EQ(said.substr(0, said.find(':')), name) << said;
  };
  for (const int j : {3, 4, 5}) {
    expect([j](Measurements& m) { m.poses.joints.col(j) *= degree; }, "joint" + std::to_string(j + 1) + "_radians");
  }
  expect([](Measurements& m) { m.poses.joints.col(4) *= -1.0; }, "joint5_sign");
  expect([](Measurements& m) { m.poses.joints.col(4).swap(m.poses.joints.col(5)); }, "joint5_joint6_exchanged");
  expect(
      [](Measurements& m) {
        m.poses.joints.col(3) *= degree;
        m.poses.joints.col(5) *= degree;
      },
      "joint4_radians+joint6_radians");
}

TEST(LikelyMistake, OfCouplingOrderUnitsAndRowsIsNamed) {
  const auto name_of = [](const std::function<void(Measurements&)>& wrong) {
    const std::string said = said_after(wrong);
    return said.substr(0, said.find(':'));
  };
  EXPECT_EQ(name_of([](Measurements& m) { m.poses.joints.col(2) -= m.poses.joints.col(1); }),
            "joint3_counted_with_joint2");
  EXPECT_EQ(name_of([](Measurements& m) { m.poses.joints = m.poses.joints.rowwise().reverse().eval(); }),
            "joints_reversed");
  EXPECT_EQ(name_of([](Measurements& m) { m.positions_mm /= 25.4; }), "positions_inches");
  EXPECT_EQ(name_of([](Measurements& m) {
              const Eigen::MatrixXd before = m.poses.joints;
              m.poses.joints.bottomRows(m.count() - 1) = before.topRows(m.count() - 1);
            }),
            "readings_early");
  const auto slip = [](Eigen::Index from) {
    return [from](Measurements& m) {
      const Eigen::MatrixXd before = m.positions_mm;
      m.positions_mm.middleRows(from, m.count() - from - 1) = before.middleRows(from + 1, m.count() - from - 1);
    };
  };
  EXPECT_EQ(name_of(slip(31)), "rows_slipped_from_32");
  EXPECT_EQ(name_of(slip(51)), "rows_slipped_from_52");
  EXPECT_EQ(name_of([](Measurements& m) { m.positions_mm.bottomRows(39).col(0).array() += 360.0; }),
            "instrument_moved_at_42");
}

TEST(LikelyMistake, OfTheDescriptionIsNamed) {
  const Robot truth = perturbed(ur_like(), 0.3, 0.05, 3);
  const Measurements seen = measure(truth, random_poses(truth.chain, 80, 4), 0.05, 5);
  Robot radians = ur_like();
  for (Joint& joint : radians.chain.joints) joint.alpha_deg *= degree;
  const std::optional<Suspicion> found = likely_mistake(radians, seen);
  ASSERT_TRUE(found);
  EXPECT_NE(found->sentence.find("the angles alpha of the description are radians"), std::string::npos)
      << found->sentence;
  Robot convention = ur_like();
  convention.chain.convention = Convention::mdh;
  const std::optional<Suspicion> other = likely_mistake(convention, seen);
  ASSERT_TRUE(other);
  EXPECT_EQ(other->name, "dh");
}

// Arms that miss by a tenth of a millimetre to centimetres, with few poses and many, are as described.
TEST(LikelyMistake, OfRightFilesIsNone) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const double size_mm = 0.02 * std::pow(1.7, static_cast<double>(seed));
    const Robot described = seed % 3 == 0 ? scara() : seed % 3 == 1 ? ur_like() : mdh_like();
    const Robot truth = perturbed(described, size_mm, 0.1 * size_mm, seed);
    const auto poses = static_cast<Eigen::Index>(20 + 7 * seed);
    const Measurements seen = measure(truth, random_poses(truth.chain, poses, seed + 100), 0.02, seed + 200);
    const std::optional<Suspicion> found = likely_mistake(described, seen);
    EXPECT_FALSE(found) << seed << ": " << found->sentence;
  }
}

// Some of the rows are looked at. A reading that is 400 mm off may be among those of the whole file alone, and not
// among those of the two parts before and after a row: they fit better without it, not because anything moved.
TEST(LikelyMistake, OfRightFilesWithGrossReadingsIsNone) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Robot truth = perturbed(ur_like(), 0.3, 0.05, seed);
    Measurements seen = measure(truth, random_poses(truth.chain, 180, seed + 100), 0.05, seed + 200);
    for (const Eigen::Index row : {49, 91}) seen.positions_mm(row, 1) += 400.0;
    const std::optional<Suspicion> found = likely_mistake(ur_like(), seen);
    EXPECT_FALSE(found) << seed << ": " << found->sentence;
  }
}

// Equal poses, few poses, and points without an error fit with nearly any change: that is no evidence.
TEST(LikelyMistake, NeedsPosesThatTellAndAnErrorToExplain) {
  const Robot truth = perturbed(ur_like(), 0.3, 0.05, 3);
  Poses equal = random_poses(truth.chain, 20, 4);
  equal.joints.rowwise() = equal.joints.row(0).eval();
  EXPECT_FALSE(likely_mistake(ur_like(), measure(truth, equal, 0.0, 5)));
  EXPECT_FALSE(likely_mistake(ur_like(), measure(truth, random_poses(truth.chain, 5, 4), 0.05, 5)));
  EXPECT_FALSE(likely_mistake(ur_like(), measure(ur_like(), random_poses(truth.chain, 60, 4), 0.0, 5)));
}

TEST(LikelyMistake, TheOrderOfQuaternionsAndTheirDirectionAreNamed) {
  const Robot truth = perturbed(ur_like(), 0.3, 0.05, 9);
  const Poses poses = random_poses(truth.chain, 60, 10);
  const std::vector<Pose> tools = tool_poses(truth, poses);
  const auto said_of = [&](const std::function<Eigen::Vector4d(const Eigen::Quaterniond&)>& written) {
    Measurements seen = measure(truth, poses, 0.05, 11);
    seen.orientation.kind = Orientation::Kind::quaternion;
    seen.orientation.values.resize(poses.count(), 4);
    for (Eigen::Index i = 0; i < poses.count(); ++i) {
      seen.orientation.values.row(i) = written(Eigen::Quaterniond(tools[i].rotation)).transpose();
    }
    seen = with_orientations(seen, truth.chain);
    const CalibrationReport report = report_calibration(ur_like(), seen, {.folds = 0});
    std::string all;
    for (const Finding& mistake : input_mistakes(ur_like(), seen, report)) all += mistake.words({}) + "\n";
    return std::to_string(static_cast<int>(is_implausible(ur_like(), seen, report))) + all;
  };
  using Q = Eigen::Quaterniond;
  EXPECT_EQ(said_of([](const Q& q) { return Eigen::Vector4d(q.w(), q.x(), q.y(), q.z()); }), "0");
  const std::string order = said_of([](const Q& q) { return Eigen::Vector4d(q.x(), q.y(), q.z(), q.w()); });
  EXPECT_TRUE(order.starts_with("1") && order.find("hold x, y, z, w") != std::string::npos) << order;
  const std::string inverse = said_of([](const Q& q) { return Eigen::Vector4d(q.w(), -q.x(), -q.y(), -q.z()); });
  EXPECT_NE(inverse.find("world as seen from the tool"), std::string::npos) << inverse;
  const std::string constant = said_of([](const Q&) { return Eigen::Vector4d(1.0, 0.0, 0.0, 0.0); });
  EXPECT_TRUE(constant.starts_with("1") && constant.find("convention") != std::string::npos) << constant;
}

// What is said of errors alone, each the line of its number.
std::string far_of(const std::vector<double>& errors) {
  const auto count = static_cast<Eigen::Index>(errors.size());
  Measurements measurements;
  measurements.poses.joints.setZero(count, 1);
  CalibrationReport report;
  report.geometric.in_sample_mm = Eigen::Map<const Eigen::VectorXd>(errors.data(), count);
  const std::optional<Finding> found = far_readings(measurements, report);
  return found ? found->words({}) : "";
}

std::vector<double> normal_errors(Random& random, int count) {
  std::vector<double> errors;
  for (int i = 0; i < count; ++i) {
    errors.push_back(Eigen::Vector3d(random.normal(), random.normal(), random.normal()).norm());
  }
  return errors;
}

TEST(FarReadings, AreNotTheTailsOfHonestErrors) {
  Random random(3);
  for (const double deviation : {1.0, 1.5}) {
    int accused = 0;
    for (int set = 0; set < 400; ++set) {
      std::vector<double> errors;
      for (int i = 0; i < 50; ++i) errors.push_back(std::exp(deviation * random.normal()));
      accused += far_of(errors).empty() ? 0 : 1;
    }
    EXPECT_LE(accused, 20) << deviation;  // 5 %; eight times the median alone accuses every second and every sixth set
  }
  for (int set = 0; set < 400; ++set) EXPECT_EQ(far_of(normal_errors(random, 50)), "");
}

TEST(FarReadings, AreNamedWhereThreeOfAFewAreBad) {
  Random random(4);
  for (const int count : {24, 30, 50}) {
    int named = 0;
    for (int set = 0; set < 100; ++set) {
      std::vector<double> errors = normal_errors(random, count);
      for (const int bad : {3, 11, 20}) errors[bad] = random.uniform(50.0, 200.0);
      named += far_of(errors).find("(rows 4, 12, 21)") != std::string::npos ? 1 : 0;
    }
    EXPECT_GE(named, 90) << count;
  }
}

}  // namespace
}  // namespace llmt::robotics
