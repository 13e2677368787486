#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/programs.hpp"
#include "llmt/csv.hpp"

namespace {

using nlohmann::json;
using program::Folder;
using program::Outcome;
using program::robot_program;

const std::string robots = LLMT_ROBOTS;

TEST(RobotProgram, PaperReproducesTheComparableRows) {
  const Folder folder;
  const Outcome outcome = folder.run(robot_program + " paper --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const json studies = json::parse(outcome.out);
  ASSERT_EQ(studies.size(), 2U);
  for (const json& study : studies) {
    EXPECT_NEAR(study["calibrability_number"], 1.78, 0.005);
    EXPECT_EQ(study["termination"], "converged");
    // By the second iteration: the model is linear in L2, L3, v2, v3.
    EXPECT_LE(study["deviation_norms_mm"].size(), 3U);
    const double calibrated = study["arm"][1]["mean_mm"];
    const double corrected = study["arm"][2]["mean_mm"];
    EXPECT_LE(study["arm"][2]["leaves"][0], 93);
    EXPECT_LE(study["arm"][2]["leaves"][1], 75);
    EXPECT_LE(corrected / calibrated, study["carry_over"] ? 0.048 : 0.037);
  }
  const json& with_carry_over = studies[0];
  const json& arm = with_carry_over["arm"];
  const double crisp = arm[2]["mean_mm"];
  EXPECT_GT(arm[6]["mean_mm"], 2.0 * crisp);  // wide Gaussians over leaves as grown: the paper's observation
  EXPECT_LE(arm[7]["mean_mm"], 0.0030);       // blend, 93 + 75 leaves
  EXPECT_LE(arm[7]["max_mm"], 0.015);
  EXPECT_LE(arm[8]["mean_mm"], 0.030);  // 25 + 25
  EXPECT_LE(with_carry_over["noisy_blend_rmse_mm"], 0.008);
  const json& black_box = studies[0]["black_box"];
  EXPECT_EQ(black_box[0]["training_poses"], 1536);
  EXPECT_LE(black_box[0]["mean_mm"], 7.877);
  EXPECT_LE(black_box[0]["max_mm"], 45.0);
  EXPECT_EQ(black_box[1]["training_poses"], 1536);  // the blend
  EXPECT_LE(black_box[1]["mean_mm"], 0.15);
  EXPECT_LE(black_box[1]["max_mm"], 0.6);
  EXPECT_EQ(black_box[2]["training_poses"], 148680);
  EXPECT_LE(black_box[2]["mean_mm"], 0.380);
  EXPECT_LE(black_box[2]["max_mm"], 1.8);
}

TEST(RobotProgram, InSampleGainOnFortyFivePosesIsNoGainOnUnseenOnes) {
  const Folder folder;
  const Outcome outcome = folder.run(robot_program + " paper --study tx200 --seeds 1 --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const json study = json::parse(outcome.out);
  for (const char* which : {"hidden_compliance", "noise_alone"}) {
    EXPECT_LT(study[which]["ratio_in_sample"]["mean"], 0.5) << which;
    EXPECT_GT(study[which]["ratio_held_out"]["mean"], 1.0) << which;
  }
}

TEST(RobotProgram, SimulatedArmIsCalibratedBackAndSimulatesAsIdentified) {
  const Folder folder;
  const std::string nominal = robots + "/tx200_like.yaml";
  // The real arm: 1 mm more on link 2, 0.05 deg more on joint 3.
  std::string text = llmt::read_file(nominal);
  text.replace(text.find("a_mm: 950.007"), 13, "a_mm: 951.007");
  text.replace(text.find("theta_deg: 89.9319"), 18, "theta_deg: 89.9819");
  folder.write("real.yaml", text);
  ASSERT_EQ(folder.run(robot_program + " simulate real.yaml --poses 150 --noise-um 10 -o d.csv").exit_code, 0);
  const Outcome outcome =
      folder.run(fmt::format("{} calibrate {} d.csv --folds 5 -o cal.yaml --json", robot_program, nominal));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const json report = json::parse(outcome.out);
  EXPECT_EQ(report["termination"], "converged");
  // Three coordinates of 10 um noise: a mean distance of 16 um.
  EXPECT_LT(report["errors"]["geometric"]["held_out_mm"]["mean"], 0.020);
  EXPECT_GT(report["errors"]["nominal"]["held_out_mm"]["mean"], 0.1);
  for (const json& parameter : report["parameters"]) {
    if (parameter["name"] == "joint3.a") {
      EXPECT_NEAR(parameter["value"], 951.007, 5.0 * double(parameter["standard_error"]));
    }
  }
  // Calibrating the calibrated robot changes nothing that matters, and its description reads back.
  const Outcome again = folder.run(robot_program + " calibrate cal.yaml d.csv --folds 0 --json");
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_NEAR(json::parse(again.out)["errors"]["geometric"]["in_sample_mm"]["mean"],
              report["errors"]["geometric"]["in_sample_mm"]["mean"], 1e-4);
}

TEST(RobotProgram, CorrectionIsKeptWhereItHelpsAndWrittenBesideTheRobot) {
  const Folder folder;
  const std::string flexible = robots + "/planar_two_link.yaml";
  ASSERT_EQ(
      folder.run(fmt::format("{} simulate {} --poses 800 --noise-um 5 -o d.csv", robot_program, flexible)).exit_code,
      0);
  std::string text = llmt::read_file(flexible);
  folder.write("rigid.yaml", text.substr(0, text.find("effects:")));
  const Outcome outcome = folder.run(robot_program +
                                     " calibrate rigid.yaml d.csv --correct --only joint2.a,joint2.b,tool.x,tool.y "
                                     "-o cal.yaml --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const json report = json::parse(outcome.out);
  EXPECT_TRUE(report["correction_kept"]);
  EXPECT_LT(report["errors"]["corrected"]["held_out_mm"]["mean"],
            0.2 * double(report["errors"]["geometric"]["held_out_mm"]["mean"]));
  EXPECT_TRUE(std::filesystem::exists(folder.file("cal.correction.json")));

  // The written pair says what the report said: simulated from it, the calibrated arm is as far from the truth.
  ASSERT_EQ(folder.run(robot_program + " simulate cal.yaml --poses 800 -o c.csv").exit_code, 0);
  const std::vector<std::string> position = {"x_mm", "y_mm", "z_mm"};
  const Eigen::MatrixXd difference =
      llmt::Csv::read(folder.file("d.csv")).numbers(position) - llmt::Csv::read(folder.file("c.csv")).numbers(position);
  EXPECT_NEAR(difference.rowwise().norm().mean(), report["errors"]["corrected"]["in_sample_mm"]["mean"], 1e-9);
}

TEST(RobotProgram, CorrectionThatHurtsIsLeftOut) {
  const Folder folder;
  const std::string arm = robots + "/tx200_like.yaml";
  ASSERT_EQ(folder.run(fmt::format("{} simulate {} --poses 60 --noise-um 20 -o d.csv", robot_program, arm)).exit_code,
            0);
  const Outcome outcome =
      folder.run(fmt::format("{} calibrate {} d.csv --correct --min-leaf 8 -o cal.yaml", robot_program, arm));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("the correction is left out"), std::string::npos) << outcome.out;
  EXPECT_FALSE(std::filesystem::exists(folder.file("cal.correction.json")));
  EXPECT_TRUE(std::filesystem::exists(folder.file("cal.yaml")));
}

TEST(RobotProgram, WrongUnitsAreSuspected) {
  const Folder folder;
  const std::string arm = robots + "/ur5.yaml";
  ASSERT_EQ(folder.run(fmt::format("{} simulate {} --poses 60 -o d.csv", robot_program, arm)).exit_code, 0);
  std::string text = llmt::read_file(folder.file("d.csv"));
  for (std::size_t at = text.find("_rad"); at != std::string::npos && at < text.find('\n'); at = text.find("_rad")) {
    text.replace(at, 4, "_deg");
  }
  folder.write("wrong.csv", text);
  const std::string calibrate = robot_program + " calibrate " + arm;
  const Outcome wrong = folder.run(calibrate + " wrong.csv --folds 0 -o wrong.yaml");
  EXPECT_EQ(wrong.exit_code, 1);
  EXPECT_NE(wrong.out.find("check units"), std::string::npos);
  EXPECT_NE(wrong.err.find("nothing is written"), std::string::npos) << wrong.err;
  EXPECT_FALSE(std::filesystem::exists(folder.file("wrong.yaml")));
  const Outcome right = folder.run(calibrate + " d.csv --folds 0 --json");
  ASSERT_EQ(right.exit_code, 0) << right.err;
  EXPECT_TRUE(json::parse(right.out)["warnings"].empty()) << right.out;
}

// The answer, the error and the advice fit on a screen; everything else follows.
TEST(RobotProgram, WhatWasDiscoveredFitsOnAScreen) {
  const Folder folder;
  const std::string arm = robots + "/tx200_like.yaml";
  std::string text = llmt::read_file(arm);
  text = text.substr(0, text.find("\neffects:")) + "\neffects:\n";
  for (int joint = 1; joint <= 5; ++joint) {
    text += fmt::format("  - {{type: eccentricity_twice, at: joint{}, cosine_rad: 3e-4, sine_rad: 1e-4}}\n", joint);
    text += fmt::format(
        "  - {{type: transmission_error, at: joint{}, order_per_turn: {}, cosine_rad: 2e-4, "
        "sine_rad: 1e-4}}\n",
        joint, 40 + joint);
  }
  folder.write("truth.yaml", text);
  ASSERT_EQ(folder.run(robot_program + " simulate truth.yaml --poses 300 --noise-um 20 -o d.csv").exit_code, 0);
  const Outcome outcome = folder.run(fmt::format("{} discover {} d.csv", robot_program, arm));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::string page = outcome.out.substr(0, outcome.out.find("\nDetails\n"));
  ASSERT_LT(page.size(), outcome.out.size());
  int lines = 0;
  for (std::size_t begin = 0; begin < page.size(); ++lines) {
    const std::size_t end = std::min(page.find('\n', begin), page.size());
    EXPECT_LE(end - begin, 100U) << page.substr(begin, end - begin);
    begin = end + 1;
  }
  EXPECT_LE(lines, 26) << page;  // the file's name and an empty line come first
  EXPECT_NE(page.find("twice per turn"), std::string::npos) << page;
  EXPECT_NE(page.find("Next: "), std::string::npos) << page;
  EXPECT_EQ(page.find("not determined"), std::string::npos);
}

TEST(RobotProgram, MistakesHaveTheirExitCodeAndMessage) {
  const Folder folder;
  const std::string arm = robots + "/ur5.yaml";
  folder.write("units.csv", "q1,q2,q3,q4,q5,q6,x_mm,y_mm,z_mm\n0,0,0,0,0,0,1,2,3\n");
  folder.write("few.csv", "q1_deg,q2_deg,x_mm,y_mm,z_mm\n0,0,1,2,3\n");
  folder.write("bad.yaml", "name: arm\nconvention: mdh\njoint:\n  - {}\n");
  const auto expect = [&](const std::string& arguments, int code, const std::string& message) {
    const Outcome outcome = folder.run(robot_program + " " + arguments);
    EXPECT_EQ(outcome.exit_code, code) << arguments << ": " << outcome.err;
    EXPECT_NE(outcome.err.find(message), std::string::npos) << arguments << ": " << outcome.err;
  };
  expect("calibrate", 2, "robot is required");
  expect("calibrate " + arm + " units.csv", 1, "unit");
  expect("calibrate " + arm + " few.csv", 1, "few.csv");
  expect("calibrate bad.yaml few.csv", 1, "bad.yaml:1: key \"joints\" is missing");
  expect("calibrate " + arm + " none.csv", 1, "none.csv: cannot be read: No such file or directory");
  expect("simulate " + arm + " --poses 0", 2, "poses");
  expect("simulate " + arm + " --poses 1000000000", 2, "must be a whole number from 1 to 1000000");
  expect("paper --study puma", 2, "puma");
}

TEST(RobotProgram, PositionsThatAreNotFiniteNameFilePoseAndEffect) {
  const Folder folder;
  const std::string arm =
      "name: arm\nconvention: dh\njoints:\n  - {name: joint1, type: revolute, alpha_deg: 0, a_mm: 500, "
      "d_mm: 0, theta_deg: 0}\n";
  folder.write("pole.yaml",
               arm + "effects:\n  - {type: formula, name: pole, terms: [{x: ln(0 * q1)}], coefficients: [1]}\n");
  std::string data = "q1_deg,x_mm,y_mm,z_mm\n";
  for (int i = 0; i < 20; ++i) data += fmt::format("{},1,2,3\n", 10 * i);
  folder.write("d.csv", data);
  for (const std::string& command :
       {std::string("simulate pole.yaml"), std::string("simulate pole.yaml --poses-from d.csv"),
        std::string("calibrate pole.yaml d.csv"), std::string("discover pole.yaml d.csv")}) {
    const Outcome outcome = folder.run(robot_program + " " + command);
    EXPECT_EQ(outcome.exit_code, 1) << command << outcome.err;
    EXPECT_NE(outcome.err.find("llmt-robot: pole.yaml: the tool position of pose 1 is "), std::string::npos)
        << command << outcome.err;
    EXPECT_NE(outcome.err.find("effect formula[pole] makes it so"), std::string::npos) << command << outcome.err;
  }
  folder.write("arm.yaml", arm);
  folder.write("far.csv", data + "0,1,1e300,3\n");
  const Outcome far = folder.run(robot_program + " calibrate arm.yaml far.csv");
  EXPECT_EQ(far.exit_code, 1);
  EXPECT_NE(far.err.find("far.csv:22: column \"y_mm\": 1e+300 mm"), std::string::npos) << far.err;
}

}  // namespace
