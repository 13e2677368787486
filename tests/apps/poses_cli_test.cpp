// Which poses to measure.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "apps/programs.hpp"

namespace {

using program::Folder;
using program::Outcome;
using program::robot_program;
using program::sample_arm;

Outcome poses(const Folder& folder, const std::string& arguments) {
  return folder.run(fmt::format("{} poses {} {}", robot_program, sample_arm, arguments));
}

TEST(PosesProgram, WritesPosesThatSimulateAndCalibrateTake) {
  const Folder folder;
  const Outcome run = poses(folder, "--count 20 -o poses.csv");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  for (const char* words : {"20 poses chosen to identify 27 parameters", "error of the tool position, mm",
                            "joint6.alpha", "Written: poses.csv"}) {
    EXPECT_NE(run.out.find(words), std::string::npos) << words << "\n" << run.out;
  }
  EXPECT_EQ(folder.run(fmt::format("{} simulate {} --poses-from poses.csv -o measured.csv", robot_program, sample_arm))
                .exit_code,
            0);
  const Outcome fit = folder.run(fmt::format("{} calibrate {} measured.csv --folds 0", robot_program, sample_arm));
  EXPECT_EQ(fit.exit_code, 0) << fit.err;
  EXPECT_NE(fit.out.find("27 parameters identified"), std::string::npos) << fit.out;
}

TEST(PosesProgram, JsonSaysWhatIsExpectedAndNoChoiceBeatsTheBound) {
  const Folder folder;
  const nlohmann::json json =
      nlohmann::json::parse(poses(folder, "--count 12 --box 400,900,-300,300,200,800 --criterion O1 --json").out);
  EXPECT_LE(json["bound_mm"].get<double>(), json["chosen"]["position_error_mm"].get<double>());
  EXPECT_LT(json["chosen"]["position_error_mm"], json["random"]["position_error_mm"]);
  EXPECT_GT(json["chosen"]["o1"], json["random"]["o1"]);
  EXPECT_EQ(json["chosen"]["parameters"].size(), 27U);
}

TEST(PosesProgram, ChoosesFromCandidatesAndAddsToMeasuredPoses) {
  const Folder folder;
  folder.run(fmt::format("{} simulate {} --poses 60 -o all.csv && {} simulate {} --poses 10 --seed 2 -o some.csv",
                         robot_program, sample_arm, robot_program, sample_arm));
  const Outcome run = poses(folder, "--count 15 --from all.csv --measured some.csv --use all.csv -o poses.csv");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("beside the 10 measured ones"), std::string::npos) << run.out;
}

TEST(PosesProgram, RefusesWhatCannotBe) {
  const Folder folder;
  const auto says = [&](const std::string& arguments, int exit_code, const std::string& what) {
    const Outcome run = poses(folder, arguments);
    EXPECT_EQ(run.exit_code, exit_code) << arguments;
    EXPECT_NE(run.err.find(what), std::string::npos) << arguments << "\n" << run.err;
  };
  says("--count 5", 2, "27 parameters need at least 9 poses");
  says("--box 1,2,3", 2, "--box: 3 numbers, must be 6");
  says("--tool 1", 2, "--tool: 1 numbers, must be 3");
  says("--box 5000,5100,0,100,0,100", 1, "no pose within the joint limits brings the tool into the box");
  says("--box 100,0,0,100,0,100", 2, "a lower bound of the box is above the upper one");
  says("--criterion O6", 2, "O6");
  says("--count 40 --spacing 170", 1, "poses differ by 170 degrees");
  folder.write("empty.csv", "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n");
  says("--from empty.csv", 1, "empty.csv");
  folder.write("one.csv", "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n1,2,3,4,5,6\n");
  says("--from one.csv", 2, "there are 1 candidates");
}

TEST(PosesProgram, ColumnsHaveTheNamesOfTheJoints) {
  const Folder folder;
  ASSERT_EQ(poses(folder, "--count 9 -o poses.csv").exit_code, 0);
  EXPECT_TRUE(llmt::read_file(folder.file("poses.csv"))
                  .starts_with("joint1_deg,joint2_deg,joint3_deg,joint4_deg,joint5_deg,joint6_deg\n"));
  // A name that means something else in such a table.
  std::string text = llmt::read_file(sample_arm);
  for (std::size_t at = 0; (at = text.find("joint2", at)) != std::string::npos;) text.replace(at, 6, "x");
  folder.write("x.yaml", text);
  const Outcome run = folder.run(robot_program + " poses x.yaml --count 9");
  EXPECT_TRUE(run.out.starts_with("q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n")) << run.out << run.err;
}

}  // namespace
