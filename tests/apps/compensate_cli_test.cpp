// Into the robot: predict, compensate, export.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>

#include "apps/programs.hpp"

namespace {

using program::Folder;
using program::Outcome;
using program::robot_program;
using program::sample_arm;

const std::string real_arm = std::string(LLMT_ROOT) + "/docs/samples/arm_true.yaml";

TEST(CompensateProgram, CommandsForANominalProgramReachItAndPredictSaysSo) {
  const Folder folder;
  ASSERT_EQ(folder.run(fmt::format("{} simulate {} --poses 300 -o program.csv", robot_program, sample_arm)).exit_code,
            0);
  folder.run("cut -d, -f1-6 program.csv > joints.csv");
  const Outcome run = folder.run(fmt::format("{} compensate {} joints.csv --nominal {} -o commands.csv --json",
                                             robot_program, real_arm, sample_arm));
  const nlohmann::json summary = nlohmann::json::parse(run.out);
  EXPECT_EQ(summary["targets"], 300);
  EXPECT_GE(summary["outcomes"]["reached"].get<int>() + summary["outcomes"]["singular"].get<int>(), 285) << run.err;
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

TEST(CompensateProgram, DegreesInAColumnOfRadiansAreSuspected) {
  const Folder folder;
  folder.write("joints.csv", "q1_rad,q2_rad,q3_rad,q4_rad,q5_rad,q6_rad\n10,-60,70,20,30,40\n");
  const Outcome run =
      folder.run(fmt::format("{} compensate {} joints.csv --nominal {}", robot_program, real_arm, sample_arm));
  EXPECT_NE(run.err.find("are the units in the column names right (_rad, _deg)?"), std::string::npos) << run.err;
}

TEST(CompensateProgram, DecimalCommasAreReadAndWritten) {
  const Folder folder;
  folder.write("p.csv", "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n10.5,-60,70,20,30,40\n");
  folder.write("c.csv", "q1_deg;q2_deg;q3_deg;q4_deg;q5_deg;q6_deg\n10,5;-60;70;20;30;40\n");
  for (const std::string& command :
       {"predict " + real_arm + " {}", "compensate " + real_arm + " {} --nominal " + sample_arm}) {
    const auto run = [&](const std::string& table) {
      return folder.run(robot_program + " " + fmt::format(fmt::runtime(command), table));
    };
    const std::string with_points = run("p.csv").out;
    std::string expected = run("c.csv --decimal-comma").out;
    EXPECT_NE(expected.find("0,"), std::string::npos) << expected;
    std::ranges::replace(expected, ',', '.');
    std::ranges::replace(expected, ';', ',');
    EXPECT_EQ(expected, with_points) << command;
    EXPECT_NE(run("c.csv").err.find("--decimal-comma reads such files"), std::string::npos) << command;
  }
}

// A description that came from a URDF knows which of its links base and tip were.
TEST(CompensateProgram, ACalibratedArmRemembersTheLinksOfItsUrdf) {
  const Folder folder;
  const std::string joint =
      "<joint name='{0}' type='revolute'><parent link='{1}'/><child link='{2}'/><origin xyz='{3}'/><axis xyz='{4}'/>"
      "<limit lower='-2' upper='2' effort='1' velocity='1'/></joint>";
  std::string urdf = "<robot name='two'>";
  for (const char* link : {"base", "upper", "fore", "hand", "camera"}) urdf += fmt::format("<link name='{}'/>", link);
  urdf += fmt::format(fmt::runtime(joint), "turn", "base", "upper", "0 0 0.3", "0 0 1");
  urdf += fmt::format(fmt::runtime(joint), "lift", "upper", "fore", "0.4 0 0", "0 1 0");
  for (const char* end : {"hand", "camera"}) {
    urdf += fmt::format(
        "<joint name='at_{0}' type='fixed'><parent link='fore'/><child link='{0}'/><origin xyz='0.3 0 0'/></joint>",
        end);
  }
  folder.write("arm.urdf", urdf + "</robot>");
  const auto run = [&](const std::string& arguments) { return folder.run(robot_program + " " + arguments); };
  ASSERT_EQ(run("simulate arm.urdf --tip-link hand --poses 40 --noise-um 5 -o d.csv").exit_code, 0);
  ASSERT_EQ(run("calibrate arm.urdf d.csv --tip-link hand -o c.yaml").exit_code, 0);
  EXPECT_NE(run("export c.yaml --deltas d.urdf").exit_code, 0);
  const Outcome deltas = run("export c.yaml --deltas arm.urdf");
  EXPECT_EQ(deltas.exit_code, 0) << deltas.err;
  folder.run("cut -d, -f1,2 d.csv > joints.csv");
  const Outcome commands = run("compensate c.yaml joints.csv --nominal arm.urdf -o commands.csv");
  EXPECT_TRUE(std::filesystem::exists(folder.file("commands.csv"))) << commands.err;
}

TEST(ExportProgram, RoundingIsZeroAndUncertainValuesAreNamed) {
  const Folder folder;
  std::string text = llmt::read_file(sample_arm);
  folder.write("arm.yaml",
               text + "\nidentified:\n  - {parameter: tool.z, state: free, standard_error: 19, unit: mm}\n");
  const Outcome poses = folder.run(robot_program + " export arm.yaml --kinematics");
  EXPECT_EQ(poses.out.find("e-"), std::string::npos) << poses.out;
  EXPECT_EQ(poses.out.find("-0,"), std::string::npos) << poses.out;
  EXPECT_NE(poses.err.find("Uncertain values: tool.z +-19 mm."), std::string::npos) << poses.err;
  const Outcome file = folder.run(robot_program + " export arm.yaml --kinematics out.yaml");
  EXPECT_EQ(file.exit_code, 2);
  EXPECT_NE(file.err.find("; --kinematics takes no file: -o out.yaml writes to it"), std::string::npos) << file.err;
}

TEST(CompensateProgram, TakesTenThousandTargets) {
  const Folder folder;
  folder.run(fmt::format("{} simulate {} --poses 10000 -o all.csv && cut -d, -f1-6 all.csv > joints.csv", robot_program,
                         sample_arm));
  const Outcome run = folder.run(fmt::format("{} compensate {} joints.csv --nominal {} -o commands.csv --json",
                                             robot_program, real_arm, sample_arm));
  const nlohmann::json summary = nlohmann::json::parse(run.out);
  EXPECT_EQ(summary.at("targets"), 10000);
  EXPECT_GT(summary.at("outcomes").at("reached").get<int>() + summary.at("outcomes").at("singular").get<int>(), 9700);
}

}  // namespace
