// Into the robot: predict, compensate, export.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <chrono>
#include <nlohmann/json.hpp>

#include "apps/program.hpp"

namespace {

using program::Folder;
using program::Outcome;

const std::string robot_program = LLMT_ROBOT_PROGRAM;
const std::string nominal = std::string(LLMT_ROOT) + "/docs/samples/arm.yaml";
const std::string real_arm = std::string(LLMT_ROOT) + "/docs/samples/arm_true.yaml";

TEST(CompensateProgram, CommandsForANominalProgramReachItAndPredictSaysSo) {
  const Folder folder;
  ASSERT_EQ(folder.run(fmt::format("{} simulate {} --poses 300 -o program.csv", robot_program, nominal)).exit_code, 0);
  folder.run("cut -d, -f1-6 program.csv > joints.csv");
  const Outcome run = folder.run(
      fmt::format("{} compensate {} joints.csv --nominal {} -o commands.csv --json", robot_program, real_arm, nominal));
  const nlohmann::json summary = nlohmann::json::parse(run.out);
  EXPECT_EQ(summary["targets"], 300);
  EXPECT_GE(summary["outcomes"]["reached"].get<int>(), 285) << run.err;
  EXPECT_GT(summary["mean_before_mm"].get<double>(), 100.0 * summary["mean_after_mm"].get<double>());
  const Outcome predicted = folder.run(fmt::format("{} predict {} commands.csv", robot_program, real_arm));
  EXPECT_EQ(predicted.exit_code, 0) << predicted.err;
  EXPECT_NE(predicted.out.find("x_mm,y_mm,z_mm"), std::string::npos);
}

TEST(CompensateProgram, UnreachableTargetsAreNamedByLineAndFlagged) {
  const Folder folder;
  folder.write("targets.csv", "x_mm,y_mm,z_mm\n500,0,500\n90000,0,500\n");
  const Outcome run = folder.run(fmt::format("{} compensate {} targets.csv -o commands.csv", robot_program, real_arm));
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.err.find("targets.csv:3:"), std::string::npos) << run.err;
  EXPECT_EQ(run.err.find("targets.csv:2:"), std::string::npos) << run.err;
  EXPECT_NE(llmt::read_file(folder.file("commands.csv")).find("outcome,covered\n"), std::string::npos);
}

TEST(CompensateProgram, WrongTargetsAreRefusedWithWhatIsMissing) {
  const Folder folder;
  const auto says = [&](const std::string& text, const std::string& what) {
    folder.write("targets.csv", text);
    const Outcome run = folder.run(fmt::format("{} compensate {} targets.csv", robot_program, real_arm));
    EXPECT_NE(run.exit_code, 0);
    EXPECT_NE(run.err.find(what), std::string::npos) << run.err;
  };
  says("x_mm,y_mm\n1,2\n", "no column z_mm");
  says("x,y,z\n1,2,3\n", "has no unit");
  says("a,b\n1,2\n", "neither joints");
  says("q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n1,2,3,4,5,6\n", "--nominal");
  says("x_mm,y_mm,z_mm,qw,qx,qy,qz\n1,2,3,0,0,0,0\n", "length 0");
}

TEST(CompensateProgram, TakesTenThousandTargets) {
  const Folder folder;
  folder.run(fmt::format("{} simulate {} --poses 10000 -o all.csv && cut -d, -f1-6 all.csv > joints.csv", robot_program,
                         nominal));
  const Outcome run = folder.run(
      fmt::format("{} compensate {} joints.csv --nominal {} -o commands.csv --json", robot_program, real_arm, nominal));
  const nlohmann::json summary = nlohmann::json::parse(run.out);
  EXPECT_EQ(summary.at("targets"), 10000);
  EXPECT_GT(summary.at("outcomes").at("reached"), 9700);
}

}  // namespace
