// Into the robot: predict, compensate, export.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <regex>

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

// The first row of a table, and the one after it.
std::pair<std::string, std::string> first_rows(const std::string& table) {
  const std::size_t first = table.find('\n');
  const std::size_t second = table.find('\n', first + 1);
  return {table.substr(0, first), table.substr(first + 1, second - first - 1)};
}

TEST(PredictProgram, JointColumnsKeepTheirNamesUnitsAndValues) {
  const Folder folder;
  folder.write("p.csv", "joint1_deg,q2_rad,q3_deg,q4_deg,q5_deg,q6_deg\n10.1,-1.05,70.3,20,0.1,40.7\n");
  const Outcome run = folder.run(fmt::format("{} predict {} p.csv -o out.csv", robot_program, real_arm));
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto [header, row] = first_rows(llmt::read_file(folder.file("out.csv")));
  EXPECT_TRUE(header.starts_with("joint1_deg,q2_rad,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,")) << header;
  EXPECT_TRUE(row.starts_with("10.1,-1.05,70.3,20,0.1,40.7,")) << row;
  // What is written reads back: the same positions, the same text.
  folder.run(fmt::format("{} predict {} out.csv -o again.csv", robot_program, real_arm));
  EXPECT_EQ(llmt::read_file(folder.file("out.csv")), llmt::read_file(folder.file("again.csv")));
}

// Names of another program, one of them with a separator, in degrees, with decimal commas; the map has a column of
// measurements that tables of poses lack.
TEST(PredictProgram, TablesOfAnotherProgramAreReadByAColumnMap) {
  const Folder folder;
  folder.write("map.yaml",
               "decimal: comma\norientation: extrinsic_xyz\n"
               "columns: {\"axis 1; turn\": q1_deg, A2: q2_deg, A3: q3_deg, A4: q4_deg, A5: q5_deg, A6: q6_deg, "
               "Mx: x_mm}\n");
  folder.write("own.csv", "\"axis 1; turn\";A2;A3;A4;A5;A6\n10,5;-60;70;20;30;40\n");
  folder.write("plain.csv", "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n10.5,-60,70,20,30,40\n");
  const auto run = [&](const std::string& arguments) { return folder.run(robot_program + " " + arguments); };
  for (const std::string& command :
       {"predict " + real_arm + " {}", "compensate " + real_arm + " {} --nominal " + sample_arm}) {
    const Outcome mapped = run(fmt::format(fmt::runtime(command), "own.csv") + " --columns map.yaml");
    ASSERT_EQ(mapped.exit_code, 0) << mapped.err;
    auto [header, row] = first_rows(mapped.out);
    EXPECT_TRUE(header.starts_with("\"axis 1; turn\";A2;A3;A4;A5;A6;")) << header;
    std::ranges::replace(row, ',', '.');
    std::ranges::replace(row, ';', ',');
    const std::string expected = first_rows(run(fmt::format(fmt::runtime(command), "plain.csv")).out).second;
    if (command.starts_with("compensate")) {
      EXPECT_EQ(row, expected);
      continue;
    }
    EXPECT_NE(header.find("rx_deg"), std::string::npos) << header;  // in the convention of the map
    folder.write("back.csv", mapped.out);
    EXPECT_EQ(run("predict " + real_arm + " back.csv --columns map.yaml").out, mapped.out);
  }
  folder.write("lacks.csv", "A2;A3;A4;A5;A6\n-60;70;20;30;40\n");
  const Outcome lacks = run("predict " + real_arm + " lacks.csv --columns map.yaml");
  EXPECT_NE(lacks.exit_code, 0);
  EXPECT_NE(lacks.err.find("there is no column q1_deg or q1_rad"), std::string::npos) << lacks.err;
}

// Orientations are those of the map's convention: the same pose, written in two of them, gives the same commands.
TEST(CompensateProgram, OrientationsAreReadInTheConventionOfTheMap) {
  const Folder folder;
  folder.write("p.csv", "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n10.5,-60,70,20,30,40\n");
  std::vector<std::string> commands;
  for (const std::string convention : {"extrinsic_zyx", "intrinsic_yxz"}) {
    folder.write("map.yaml", fmt::format("orientation: {}\ncolumns: {{}}\n", convention));
    folder.run(fmt::format("{} predict {} p.csv --columns map.yaml -o asked.csv", robot_program, real_arm));
    const Outcome run = folder.run(
        fmt::format("{} compensate {} asked.csv --columns map.yaml --json -o c.csv", robot_program, real_arm));
    ASSERT_EQ(run.exit_code, 0) << run.err;
    commands.push_back(first_rows(llmt::read_file(folder.file("c.csv"))).second);
    EXPECT_TRUE(commands.back().starts_with("10.5,-60,70,20,30,40,")) << commands.back();
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
  const Outcome as_urdf = run("calibrate arm.urdf d.csv --tip-link hand -o out.urdf");
  EXPECT_NE(as_urdf.out.find("its tip is the identified tool"), std::string::npos) << as_urdf.out;
  const Outcome inside = run("calibrate arm.urdf d.csv --tip-link fore -o inside.urdf");
  EXPECT_NE(inside.out.find("Its tip is where it was: no fixed joint holds it"), std::string::npos) << inside.out;
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

// The tool of a real arm may look sideways but for a thousandth of a second of arc.
TEST(ExportProgram, AToolNextToAQuarterTurnOfPitchKeepsItsDigits) {
  const Folder folder;
  const std::string arm = llmt::read_file(sample_arm);
  folder.write("arm.yaml", std::regex_replace(arm, std::regex("\\ntool:[^\\n]*"),
                                              "\ntool: {xyz_mm: [0, 0, 90], rpy_deg: [35, 89.9999999, -70]}"));
  const std::string text = folder.run(robot_program + " export arm.yaml --kinematics").out;
  std::smatch found;
  ASSERT_TRUE(std::regex_search(text, found, std::regex("tool: .*roll: (.*), pitch: (.*), yaw: (.*)\\}"))) << text;
  const auto rotation = [](double roll, double pitch, double yaw) {
    return (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
            Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()))
        .toRotationMatrix();
  };
  constexpr double degree = 0.017453292519943295;
  const Eigen::Matrix3d written = rotation(std::stod(found[1]), std::stod(found[2]), std::stod(found[3]));
  const Eigen::Matrix3d meant = rotation(35.0 * degree, 89.9999999 * degree, -70.0 * degree);
  EXPECT_LT((written - meant).cwiseAbs().maxCoeff(), 1e-14);
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
