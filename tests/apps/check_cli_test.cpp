// Is it still good? And the demonstration.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "apps/programs.hpp"

namespace {

using program::Folder;
using program::Outcome;
using program::robot_program;

const std::string samples = std::string(LLMT_ROOT) + "/docs/samples/";

void calibrate_sample(const Folder& folder) {
  std::string text = llmt::read_file(samples + "arm_true.yaml");
  folder.write("real.yaml", text.substr(0, text.find("\neffects:")) + "\n");
  folder.run(
      fmt::format("{0} simulate real.yaml --poses 80 --noise-um 20 -o d.csv && {0} calibrate {1}arm.yaml d.csv -o "
                  "cal.yaml && {0} simulate real.yaml --poses 40 --noise-um 20 --seed 2 -o new.csv",
                  robot_program, samples));
}

TEST(CheckProgram, AnArmThatStayedIsGoodAndOneThatWasKnockedIsNot) {
  const Folder folder;
  calibrate_sample(folder);
  const Outcome good = folder.run(robot_program + " check cal.yaml new.csv");
  EXPECT_EQ(good.exit_code, 0) << good.err;
  EXPECT_NE(good.out.find("STILL GOOD."), std::string::npos) << good.out;
  EXPECT_NE(good.out.find("set up anew"), std::string::npos) << good.out;
  std::string real = llmt::read_file(folder.file("real.yaml"));
  const std::string before = "theta_deg: 0.06";
  ASSERT_NE(real.find(before), std::string::npos);
  folder.write("knocked.yaml", real.replace(real.find(before), before.size(), "theta_deg: 0.08"));
  folder.run(robot_program + " simulate knocked.yaml --poses 40 --noise-um 20 --seed 3 -o knocked.csv");
  const Outcome bad = folder.run(robot_program + " check cal.yaml knocked.csv");
  EXPECT_EQ(bad.exit_code, 1);
  EXPECT_NE(bad.out.find("NO LONGER GOOD."), std::string::npos) << bad.out;
  EXPECT_NE(bad.out.find("joint3.theta: 0.0"), std::string::npos) << bad.out;
  EXPECT_NE(bad.err.find("the mean error is"), std::string::npos) << bad.err;
  const Outcome json = folder.run(robot_program + " check cal.yaml knocked.csv --accuracy-mm 5 --json");
  EXPECT_EQ(json.exit_code, 3);
  EXPECT_TRUE(json.err.empty()) << json.err;
  EXPECT_EQ(nlohmann::json::parse(json.out)["moved"][0]["name"], "joint3.theta");
  EXPECT_EQ(nlohmann::json::parse(json.out)["verdict"], "moved, within limits");
  const Outcome moved = folder.run(robot_program + " check cal.yaml knocked.csv --accuracy-mm 5");
  EXPECT_NE(moved.out.find("\nMOVED, WITHIN LIMITS."), std::string::npos) << moved.out;
  EXPECT_EQ(folder.run(robot_program + " check cal.yaml new.csv --same-session").exit_code, 0);
}

TEST(CheckProgram, ALostBeamIsNamedByLineAndLeftOut) {
  const Folder folder;
  calibrate_sample(folder);
  std::istringstream table(llmt::read_file(folder.file("new.csv")));
  std::string changed;
  std::string text;
  for (int line = 1; std::getline(table, text); ++line) {
    if (line == 9) {
      const std::size_t last = text.rfind(',');
      text = fmt::format("{},{:.6f}", text.substr(0, last), std::stod(text.substr(last + 1)) + 5.0);
    }
    changed += text + "\n";
  }
  folder.write("lost.csv", changed);
  const Outcome run = folder.run(robot_program + " check cal.yaml lost.csv");
  EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_NE(run.out.find("\nSTILL GOOD."), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("1 reading lies far from the robot while the others agree, and was left out:\n  line 9: 4.98"),
            std::string::npos)
      << run.out;
  const nlohmann::json json = nlohmann::json::parse(folder.run(robot_program + " check cal.yaml lost.csv --json").out);
  EXPECT_EQ(json["bad"][0]["line"], 9);
  EXPECT_EQ(json["poses"], 39);
}

TEST(CheckProgram, WhatCannotBeJudgedIsNeitherGoodNorBad) {
  const Folder folder;
  calibrate_sample(folder);
  folder.run("head -n 6 new.csv > few.csv");
  const Outcome few = folder.run(robot_program + " check cal.yaml few.csv");
  EXPECT_EQ(few.exit_code, 4) << few.err;
  EXPECT_NE(few.err.find("there are 5 poses, at least 8 are needed"), std::string::npos) << few.err;
  folder.run("sed 1s/_rad/_deg/g new.csv > wrong.csv");
  EXPECT_EQ(folder.run(robot_program + " check cal.yaml wrong.csv").exit_code, 4);
  EXPECT_EQ(folder.run(robot_program + " check " + samples + "arm.yaml new.csv").exit_code, 4);
}

TEST(CheckProgram, PosesBeyondTheCalibratedRangesAreNamedByLineAndJoint) {
  const Folder folder;
  calibrate_sample(folder);
  std::string cal = llmt::read_file(folder.file("cal.yaml"));
  const std::size_t range = cal.find("range_deg: [", cal.find("joint: joint3", cal.find("joint_ranges:")));
  ASSERT_NE(range, std::string::npos);
  cal.replace(range, cal.find(']', range) - range, "range_deg: [-20, 20");
  folder.write("narrow.yaml", cal);
  const Outcome run = folder.run(robot_program + " check narrow.yaml new.csv");
  EXPECT_NE(run.out.find(" of 40 readings lie beyond the calibrated ranges (lines "), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("  joint3 from -"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find(", calibrated from -20 to 20 (lines "), std::string::npos) << run.out;
  const nlohmann::json json =
      nlohmann::json::parse(folder.run(robot_program + " check narrow.yaml new.csv --json").out)["uncovered"];
  // By hand: readings with the third joint more than 4 degrees beyond, a tenth of the range.
  std::vector<int> expected;
  std::istringstream table(llmt::read_file(folder.file("new.csv")));
  std::string text;
  std::getline(table, text);
  for (int line = 2; std::getline(table, text); ++line) {
    std::istringstream cells(text);
    std::string cell;
    for (int k = 0; k < 3; ++k) std::getline(cells, cell, ',');
    if (std::abs(std::stod(cell)) > 24.0 * 0.017453292519943295) expected.push_back(line);
  }
  EXPECT_EQ(json["lines"].get<std::vector<int>>(), expected);
  EXPECT_EQ(json["joints"][0]["lines"].get<std::vector<int>>(), expected);
  EXPECT_EQ(json["readings"], expected.size());
  EXPECT_TRUE(json["moved_beyond"].is_array());
}

// Effects have the names that people use.
TEST(CheckProgram, NamesEffectsInWords) {
  const Folder folder;
  std::string text = llmt::read_file(samples + "arm_true.yaml");
  text = text.substr(0, text.find("\neffects:"));
  const auto with_wave = [&](const char* size) {
    return fmt::format(
        "{}\neffects:\n  - {{type: transmission_error, at: joint2, order_per_turn: 7.7812, cosine_rad: {}, "
        "sine_rad: 1e-4}}\n",
        text, size);
  };
  folder.write("wave.yaml", with_wave("3e-4"));
  folder.write("grown.yaml", with_wave("9e-4"));
  const Outcome made = folder.run(fmt::format(
      "{0} simulate wave.yaml --poses 80 --noise-um 20 -o d.csv && {0} calibrate wave.yaml d.csv -o cal.yaml "
      "&& {0} simulate grown.yaml --poses 60 --noise-um 20 --seed 2 -o new.csv",
      robot_program));
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const Outcome run = folder.run(robot_program + " check cal.yaml new.csv");
  EXPECT_EQ(run.out.find("transmission_error@"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("joint2 (order per turn 7.7812)"), std::string::npos) << run.out;
}

TEST(CheckProgram, RefusesWhatIsNoCalibration) {
  const Folder folder;
  calibrate_sample(folder);
  const Outcome run = folder.run(fmt::format("{} check {}arm.yaml new.csv", robot_program, samples));
  EXPECT_EQ(run.exit_code, 4);
  EXPECT_NE(run.err.find("arm.yaml, new.csv: "), std::string::npos) << run.err;
  EXPECT_NE(run.err.find("it was not calibrated"), std::string::npos) << run.err;
  const Outcome exchanged = folder.run(robot_program + " check new.csv cal.yaml");
  EXPECT_EQ(exchanged.exit_code, 2);
  EXPECT_NE(exchanged.err.find("exchanged"), std::string::npos) << exchanged.err;
}

// The commands that the demonstration shows, given by hand, write the same files.
TEST(DemoProgram, ShowsCommandsThatDoTheSame) {
  const Folder folder;
  const Outcome demo = folder.run(robot_program + " demo -o shown");
  ASSERT_EQ(demo.exit_code, 0) << demo.err;
  EXPECT_EQ(demo.err, "");
  folder.run("mkdir again && cp shown/arm.yaml shown/real_arm.yaml shown/program.csv again");
  std::istringstream lines(demo.out);
  int commands = 0;
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("$ llmt-robot ")) continue;
    ++commands;
    const Outcome run = folder.run("cd again && " + robot_program + line.substr(std::string("$ llmt-robot").size()));
    EXPECT_EQ(run.exit_code, 0) << line << "\n" << run.err;
  }
  EXPECT_EQ(commands, 7);
  const Outcome same = folder.run("diff -r shown again");
  EXPECT_EQ(same.exit_code, 0) << same.out;
  EXPECT_EQ(folder.run(robot_program + " demo -o shown").exit_code, 2);  // is there already
}

}  // namespace
