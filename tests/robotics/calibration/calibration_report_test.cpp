#include "llmt/robotics/calibration_report.hpp"
#include "llmt/robotics/likely_mistake.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <numbers>

#include "llmt/files.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/statistics.hpp"
#include "oracles/thrown.hpp"
#include "robotics/robots.hpp"

namespace llmt::robotics {
namespace {

TEST(CalibrationReport, RemembersTheMeanAndTheSpreadOfErrorsLeftOut) {
  CalibrationRecord record;
  remember_errors(record, Eigen::Vector4d(1.0, 2.0, 3.0, 6.0));
  EXPECT_DOUBLE_EQ(*record.held_out_mm, 3.0);
  EXPECT_DOUBLE_EQ(*record.held_out_sd_mm, std::sqrt(14.0 / 3.0));
  remember_errors(record, Eigen::VectorXd::Constant(1, 0.5));
  EXPECT_EQ(*record.held_out_sd_mm, 0.0);
}

// An arm whose first joint angle errs by a step: nothing that geometry can take up, easy for a tree.
Measurements with_step(const Robot& truth, Eigen::Index n, double step_rad, std::uint64_t seed) {
  Measurements m = measure(truth, random_poses(truth.chain, n, seed), 0.02, seed + 1);
  Poses moved = m.poses;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (moved.joints(i, 0) > 0.3) moved.joints(i, 0) += step_rad;
  }
  m.positions_mm += positions(truth, moved) - positions(truth, m.poses);
  return m;
}

TEST(ErrorFigures, AreThoseOfTheSortedDistances) {
  const ErrorFigures figures = error_figures(Eigen::VectorXd::LinSpaced(100, 1.0, 100.0));
  EXPECT_DOUBLE_EQ(figures.mean, 50.5);
  EXPECT_DOUBLE_EQ(figures.max, 100.0);
  EXPECT_DOUBLE_EQ(figures.p95, 95.0);
  EXPECT_NEAR(figures.rms, std::sqrt(338350.0 / 100.0), 1e-12);
  EXPECT_THROW(error_figures(Eigen::VectorXd()), std::invalid_argument);
}

TEST(CalibrationReport, StagesFallFromNominalOverGeometricToCorrected) {
  const Robot truth = perturbed(mdh_like(), 0.5, 0.05, 1);
  const CalibrationReport report = report_calibration(mdh_like(), with_step(truth, 500, 0.002, 2), {.correct = true});
  const double nominal = report.nominal.held_out_mm.mean();
  const double geometric = report.geometric.held_out_mm.mean();
  const double corrected = report.corrected->held_out_mm.mean();
  EXPECT_LT(geometric, nominal);
  EXPECT_LT(corrected, 0.8 * geometric);
  EXPECT_TRUE(report.correction_kept) << report.decision;
  EXPECT_TRUE(report.best().correction.has_value());
  EXPECT_EQ(report.fold_terminations.size(), 5u);
}

TEST(CalibrationReport, CorrectionOfPureNoiseIsLeftOut) {
  const Robot truth = perturbed(ur_like(), 0.5, 0.05, 3);
  const Measurements seen = measure(truth, random_poses(truth.chain, 60, 4), 0.05, 5);
  ReportOptions options{.correct = true};
  options.correction.significance = 1.0;  // a tree that follows every wiggle
  options.correction_folds = 0;
  options.correction.max_leaves = 5;
  const CalibrationReport report = report_calibration(ur_like(), seen, options);
  EXPECT_LT(report.corrected->in_sample_mm.mean(), report.geometric.in_sample_mm.mean());
  EXPECT_FALSE(report.correction_kept) << report.decision;
  EXPECT_NE(report.decision.find("left out"), std::string::npos);
  EXPECT_FALSE(report.best().correction.has_value());
}

TEST(CalibrationReport, RepeatsOfAPoseShareAFold) {
  const Robot truth = perturbed(ur_like(), 0.5, 0.05, 6);
  Poses once = random_poses(truth.chain, 50, 7);
  Poses poses{.joints = once.joints.replicate(2, 1), .covariates = {}};
  poses.covariates["pose"] = Eigen::VectorXd::LinSpaced(50, 0.0, 49.0).replicate(2, 1);
  EXPECT_TRUE(report_calibration(ur_like(), measure(truth, poses, 0.05, 8)).grouped);
}

TEST(CalibrationReport, WithoutFoldsThereAreNoHeldOutFigures) {
  const Robot truth = perturbed(ur_like(), 0.5, 0.05, 9);
  const CalibrationReport report =
      report_calibration(ur_like(), measure(truth, random_poses(truth.chain, 50, 10), 0.05, 11), {.folds = 0});
  EXPECT_EQ(report.geometric.held_out_mm.size(), 0);
  EXPECT_EQ(report.nominal.in_sample_mm.size(), 50);
}

TEST(CalibrationReport, DescriptionOfAnotherRobotIsSaidNotToBelong) {
  const Robot other = mdh_like();
  const Robot own = perturbed(ur_like(), 0.5, 0.05, 16);
  for (const int folds : {0, 5}) {
    const auto mistakes_of = [&](const Robot& measured) {
      const Measurements seen = measure(measured, random_poses(measured.chain, 60, 17), 0.05, 18);
      return words(input_mistakes(ur_like(), seen, report_calibration(ur_like(), seen, {.folds = folds})), {});
    };
    const std::vector<std::string> wrong = mistakes_of(other);
    ASSERT_FALSE(wrong.empty());
    EXPECT_NE(wrong.back().find("does not belong to these measurements"), std::string::npos) << wrong.back();
    EXPECT_NE(wrong.back().find(folds > 0 ? "held-out points" : "measured points"), std::string::npos) << wrong.back();
    EXPECT_TRUE(mistakes_of(own).empty());
  }
}

TEST(CalibrationReport, SoFewPosesThatAnyValuesFitAreSaid) {
  const Robot truth = perturbed(ur_like(), 0.5, 0.05, 19);
  const auto mistakes_of = [&](Eigen::Index poses) {
    const Measurements seen = measure(truth, random_poses(truth.chain, poses, 20), 0.05, 21);
    return words(input_mistakes(ur_like(), seen, report_calibration(ur_like(), seen)), {});
  };
  const std::vector<std::string> few = mistakes_of(11);
  ASSERT_EQ(few.size(), 1U);
  EXPECT_NE(few[0].find(" parameters were identified from 33 measured coordinates: so few poses"), std::string::npos)
      << few[0];
  EXPECT_TRUE(mistakes_of(40).empty());
}

TEST(CalibrationReport, ACalibrationWithoutGainOnUnseenPosesIsSaid) {
  const Robot truth = perturbed(ur_like(), 0.0, 0.0, 22);  // the description is right, there is nothing to gain
  const Measurements seen = measure(truth, random_poses(truth.chain, 40, 23), 0.05, 24);
  const CalibrationReport report = report_calibration(ur_like(), seen);
  ASSERT_GE(report.geometric.held_out_mm.mean(), report.nominal.held_out_mm.mean());
  const std::vector<Finding> found = input_mistakes(ur_like(), seen, report);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].code, "no_gain");
  EXPECT_TRUE(found[0].is_mistake);
  EXPECT_EQ(found[0].words({}),
            "on poses left out the calibrated robot is no better than the described one: keep the description, or "
            "measure more poses");
}

// The mistake that would explain what was seen; empty: none.
std::string last_mistake(const Robot& described, const Measurements& seen) {
  const std::optional<Suspicion> found = likely_mistake(described, seen);
  return found ? found->sentence : std::string();
}

TEST(CalibrationReport, UnitsThatWouldFitAreNamed) {
  const Robot truth = perturbed(ur_like(), 0.5, 0.05, 25);
  const Measurements right = measure(truth, random_poses(truth.chain, 60, 26), 0.05, 27);
  const auto said_of = [&](double of_angles, double of_positions) {
    Measurements wrong = right;
    wrong.poses.joints *= of_angles;
    wrong.positions_mm *= of_positions;
    return last_mistake(ur_like(), wrong);
  };
  constexpr double degree = std::numbers::pi / 180.0;
  EXPECT_EQ(said_of(1.0, 1.0), "");
  EXPECT_EQ(said_of(degree, 1.0).find("most likely the angles of the table are radians, not degrees"), 0U);
  EXPECT_EQ(said_of(1.0 / degree, 1.0).find("most likely the angles of the table are degrees, not radians"), 0U);
  EXPECT_EQ(said_of(1.0, 1e-3).find("most likely the measured positions are metres, not millimetres"), 0U);
  EXPECT_EQ(said_of(1.0, 1e3).find("most likely the measured positions are millimetres, not metres"), 0U);
  EXPECT_EQ(said_of(1.0, 1.5).find("most likely"), std::string::npos);  // no unit
}

TEST(CalibrationReport, UnitsOfTheDescriptionThatWouldFitAreNamed) {
  const Robot truth = perturbed(ur_like(), 0.5, 0.05, 25);
  const Measurements seen = measure(truth, random_poses(truth.chain, 60, 26), 0.05, 27);
  const auto said_of = [&](double of_angles, double of_lengths) {
    Robot wrong = ur_like();
    for (Joint& joint : wrong.chain.joints) {
      for (double* angle : {&joint.alpha_deg, &joint.theta_deg, &joint.beta_deg}) *angle *= of_angles;
      for (double* length : {&joint.a_mm, &joint.d_mm, &joint.b_mm}) *length *= of_lengths;
    }
    return last_mistake(wrong, seen);
  };
  constexpr double degree = std::numbers::pi / 180.0;
  EXPECT_EQ(said_of(1.0, 1.0), "");
  EXPECT_EQ(said_of(degree, 1.0).find("most likely the angles of the description are radians, not degrees"), 0U);
  EXPECT_EQ(said_of(1.0 / degree, 1.0).find("most likely the angles of the description are degrees, not radians"), 0U);
  EXPECT_EQ(said_of(1.0, 1e-3).find("most likely the lengths of the description are metres, not millimetres"), 0U);
  EXPECT_EQ(said_of(1.0, 1e3).find("most likely the lengths of the description are millimetres, not metres"), 0U);
}

TEST(Correction, IsTheSameSeenFromAnotherBase) {
  const Robot truth = perturbed(mdh_like(), 0.0, 0.0, 12);
  const Measurements seen = with_step(truth, 300, 0.002, 13);
  const CorrectedRobot here{truth, fit_correction(truth, seen).model};
  CorrectedRobot there = here;
  there.robot.chain.base = Frame{};
  const Eigen::MatrixXd shift_here = positions(here, seen.poses) - positions(here.robot, seen.poses);
  const Eigen::MatrixXd shift_there = positions(there, seen.poses) - positions(there.robot, seen.poses);
  EXPECT_GT(shift_here.norm(), 1.0);
  EXPECT_LT((shift_here.rowwise().norm() - shift_there.rowwise().norm()).norm(), 1e-9);
}

TEST(Correction, SavedRobotWithItsModelPredictsTheSame) {
  const Robot truth = perturbed(mdh_like(), 0.0, 0.0, 14);
  const Measurements seen = with_step(truth, 300, 0.002, 15);
  CorrectedRobot corrected{truth, fit_correction(truth, seen).model};
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "correction_test";
  std::filesystem::create_directories(folder);
  corrected.robot.correction_file = "model.json";
  write_file((folder / "model.json").string(), to_json(*corrected.correction));
  save(corrected.robot, (folder / "arm.yaml").string());
  const CorrectedRobot again = read_corrected_robot((folder / "arm.yaml").string());
  EXPECT_EQ(positions(again, seen.poses), positions(corrected, seen.poses));
  std::filesystem::remove_all(folder);
}

TEST(Correction, MustBeAModelOfTheRobotsJoints) {
  const Robot truth = perturbed(mdh_like(), 0.0, 0.0, 14);
  const Measurements seen = with_step(truth, 300, 0.002, 15);
  const Model right = fit_correction(truth, seen).model;
  const std::vector<std::string> joints = {"q1_rad", "q2_rad", "q3_rad", "q4_rad", "q5_rad", "q6_rad"};
  const std::vector<std::string> outputs = {"dx_mm", "dy_mm", "dz_mm"};
  const auto refusal = [&](const std::vector<std::string>& inputs, const std::vector<std::string>& names) {
    const CorrectedRobot robot{truth, right.named(inputs, names)};
    return oracle::thrown([&] { positions(robot, seen.poses); });
  };
  EXPECT_EQ(refusal(joints, outputs), "nothing was thrown");
  EXPECT_EQ(
      refusal({"q2_rad", "q1_rad", "q3_rad", "q4_rad", "q5_rad", "q6_rad"}, outputs),
      "llmt::robotics: the correction has the inputs q2_rad, q1_rad, q3_rad, q4_rad, q5_rad, q6_rad, robot \"arm\" "
      "needs the numbers q1_rad, q2_rad, q3_rad, q4_rad, q5_rad, q6_rad, in this order");
  EXPECT_NE(refusal({"q1_mm", "q2_rad", "q3_rad", "q4_rad", "q5_rad", "q6_rad"}, outputs), "nothing was thrown");
  EXPECT_NE(refusal(joints, {"dx_mm", "dy_mm", "dw_mm"}).find("\"dw_mm\" of the correction is none of"),
            std::string::npos);
  CorrectedRobot shorter{truth, right};
  shorter.robot.chain.joints.pop_back();
  EXPECT_THROW(positions(shorter, {seen.poses.joints.leftCols(5), {}}), std::invalid_argument);
}

// Errors of five joints that add up.
TEST(Correction, ASumExplainsOnPosesLeftOutMoreThanATree) {
  const Robot truth = perturbed(mdh_like(), 0.5, 0.05, 1);
  Measurements seen = measure(truth, random_poses(truth.chain, 400, 2), 0.02, 3);
  for (Eigen::Index i = 0; i < seen.poses.count(); ++i) {
    const auto q = [&](Eigen::Index joint) { return seen.poses.joints(i, joint); };
    for (Eigen::Index joint = 0; joint < 5; ++joint) seen.positions_mm(i, 2) += 0.5 * std::sin(4.0 * q(joint));
  }
  const CalibrationReport tree = report_calibration(mdh_like(), seen, {.correct = true, .folds = 2});
  const CalibrationReport sum = report_calibration(mdh_like(), seen, {.correct = true, .boost = true, .folds = 2});
  EXPECT_TRUE(sum.correction_kept) << sum.decision;
  EXPECT_TRUE(paired_difference(tree.corrected->held_out_mm, sum.corrected->held_out_mm).is_beyond_chance());
  const CorrectedRobot best = sum.best();
  ASSERT_TRUE(best.correction && std::holds_alternative<BoostedModel>(*best.correction));
  const CorrectedRobot again{best.robot, correction_from_json(to_json(*best.correction))};
  EXPECT_EQ(positions(again, seen.poses), positions(best, seen.poses));
  // Each component is held to what was seen.
  Measurements far = seen;
  far.poses.joints.array() *= 3.0;
  far.positions_mm = positions(best, far.poses);
  EXPECT_LE(residuals(best.robot, far).col(2).maxCoeff(), outputs_of(*best.correction)[2].high + 1e-9);
  EXPECT_EQ(oracle::thrown<std::runtime_error>([] { correction_from_json("Password: 1234", "secret.txt"); }),
            "secret.txt is no model");
}

TEST(Correction, OfAFileThatIsNoModelShowsNothingOfIt) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "correction_secret_test";
  std::filesystem::create_directories(folder);
  Robot robot = mdh_like();
  robot.correction_file = "../correction_secret_test/secret.txt";
  save(robot, (folder / "arm.yaml").string());
  write_file((folder / "secret.txt").string(), "Password: 1234\n");
  const auto refusal = [&] {
    return oracle::thrown<std::runtime_error>([&] { read_corrected_robot((folder / "arm.yaml").string()); });
  };
  EXPECT_TRUE(refusal().starts_with((folder / "arm.yaml").string() + ": correction: ")) << refusal();
  EXPECT_TRUE(refusal().ends_with("secret.txt is no model file")) << refusal();
  const Measurements seen = with_step(robot, 300, 0.002, 15);
  const Model other = fit(seen.poses.joints.leftCols(3), seen.positions_mm.leftCols(1)).model;
  llmt::save(other.named({"b1", "b2", "b3"}, {"dx_mm"}), (folder / "secret.txt").string());
  EXPECT_NE(refusal().find("secret.txt: llmt::robotics: the correction has the inputs b1, b2, b3"), std::string::npos)
      << refusal();
  std::filesystem::remove_all(folder);
}

TEST(UncertainParameters, AreThoseThatThePosesDoNotDetermineAlone) {
  Robot robot = ur_like();
  EXPECT_TRUE(uncertain_parameters(robot).empty());
  robot.identified = {{.name = "tool.z", .standard_error = 19.0, .state = "free"},
                      {.name = "tool.x", .standard_error = 0.5, .state = "free"},
                      {.name = "joint5.theta", .standard_error = 0.2, .state = "free"},
                      {.name = "joint4.theta", .standard_error = 0.1, .state = "free"},
                      {.name = "joint1.d", .standard_error = {}, .state = "free, not identifiable"}};
  std::vector<std::string> names;
  for (const IdentifiedParameter& one : uncertain_parameters(robot)) names.push_back(one.name);
  EXPECT_EQ(names, (std::vector<std::string>{"tool.z", "joint5.theta"}));
}

}  // namespace
}  // namespace llmt::robotics
