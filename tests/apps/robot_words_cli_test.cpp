// What the program llmt-robot says of files that are not as they should be.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <filesystem>

#include <algorithm>
#include <vector>

#include "apps/programs.hpp"
#include "llmt/csv.hpp"

namespace {

using program::Folder;
using program::Outcome;
using program::robot_program;
using program::sample_arm;
using program::sample_measured;

// The sample with some columns named and multiplied otherwise.
std::string sample(double of_angles, const std::string& angle_unit, double of_positions, const std::string& unit) {
  const llmt::Csv csv = llmt::Csv::read(sample_measured);
  std::vector<std::string> names;
  Eigen::MatrixXd values = csv.numbers(csv.columns());
  for (std::size_t c = 0; c < csv.columns().size(); ++c) {
    const bool is_angle = csv.columns()[c].starts_with("q");
    names.push_back(csv.columns()[c].substr(0, csv.columns()[c].find('_') + 1) + (is_angle ? angle_unit : unit));
    values.col(static_cast<Eigen::Index>(c)) *= is_angle ? of_angles : of_positions;
  }
  std::string text = fmt::format("{}\n", fmt::join(names, ","));
  for (Eigen::Index row = 0; row < values.rows(); ++row) {
    for (Eigen::Index c = 0; c < values.cols(); ++c) text += fmt::format("{}{}", c == 0 ? "" : ",", values(row, c));
    text += '\n';
  }
  return text;
}

TEST(RobotWords, DecimalCommasAreReadWhereAsked) {
  const Folder folder;
  std::string text = llmt::read_file(sample_measured);
  std::ranges::replace(text, ',', ';');
  std::ranges::replace(text, '.', ',');
  folder.write("d.csv", text);
  for (const std::string command : {"calibrate", "discover"}) {
    const Outcome refused = folder.run(fmt::format("{} {} {} d.csv", robot_program, command, sample_arm));
    EXPECT_EQ(refused.exit_code, 1);
    EXPECT_NE(refused.err.find("; --decimal-comma reads such files"), std::string::npos) << refused.err;
    const std::string command_line = fmt::format("{} {} {} ", robot_program, command, sample_arm);
    const Outcome with_points =
        folder.run("cp " + sample_measured + " p.csv; " + command_line + "p.csv --json | grep -v p.csv");
    const Outcome with_commas = folder.run(command_line + "d.csv --decimal-comma --json | grep -v d.csv");
    EXPECT_EQ(with_commas.exit_code, 0) << with_commas.err;
    EXPECT_EQ(program::without_record(with_commas.out), program::without_record(with_points.out));
  }
}

TEST(RobotWords, DescriptionAndMeasurementsThatWereExchangedAreNamed) {
  const Folder folder;
  folder.write("r.yaml", llmt::read_file(sample_arm));
  folder.write("d.csv", llmt::read_file(sample_measured));
  // Two chains: which one is meant would be asked if the files were in order.
  folder.write("r.urdf", R"(<robot name="r"><link name="a"/><link name="b"/><link name="c"/>
    <joint name="1" type="revolute"><parent link="a"/><child link="b"/></joint>
    <joint name="2" type="revolute"><parent link="a"/><child link="c"/></joint></robot>)");
  for (const std::string command : {"calibrate", "discover"}) {
    const Outcome urdf = folder.run(fmt::format("{} {} d.csv r.urdf", robot_program, command));
    EXPECT_EQ(urdf.exit_code, 2);
    EXPECT_TRUE(urdf.err.starts_with("llmt-robot: d.csv and r.urdf seem to be exchanged: ")) << urdf.err;
    const Outcome outcome = folder.run(fmt::format("{} {} d.csv r.yaml", robot_program, command));
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_EQ(outcome.err,
              "llmt-robot: d.csv and r.yaml seem to be exchanged: the description (YAML or URDF) comes first, "
              "then the measurements (CSV)\n");
  }
  const Outcome check = folder.run(robot_program + " check r.yaml r.urdf");
  EXPECT_EQ(check.exit_code, 2);
  EXPECT_EQ(check.err,
            "llmt-robot: r.yaml and r.urdf seem to be exchanged: the calibrated description (YAML) comes first, then "
            "the measurements (CSV)\n");
}

TEST(RobotWords, UnitsThatWouldFitAreNamed) {
  const Folder folder;
  const auto said = [&](const std::string& command, const std::string& table) {
    folder.write("d.csv", table);
    const Outcome outcome = folder.run(fmt::format("{} {} {} d.csv", robot_program, command, sample_arm));
    return outcome.out + outcome.err;
  };
  for (const std::string command : {"calibrate", "discover"}) {
    const auto expect = [&](const std::string& table, const std::string& words) {
      const std::string text = said(command, table);
      EXPECT_NE(text.find("WARNING: " + words), std::string::npos) << command << ": " << words << "\n" << text;
    };
    expect(sample(1.0, "deg", 1.0, "mm"), "most likely the angles of the table are radians, not degrees");
    expect(sample(57.29577951308232, "rad", 1.0, "mm"), "most likely the angles of the table are degrees, not radians");
    expect(sample(1.0, "rad", 0.001, "mm"), "most likely the measured positions are metres, not millimetres");
    expect(sample(1.0, "rad", 1.0, "m"), "most likely the measured positions are millimetres, not metres");
    EXPECT_EQ(said(command, sample(1.0, "rad", 0.001, "m")).find("WARNING"), std::string::npos) << command;
  }
}

// A file that would wreck a machine is not written, unless its user knows better.
TEST(RobotWords, NothingIsWrittenForASuspicion) {
  const Folder folder;
  folder.write("d.csv", sample(1.0, "deg", 1.0, "mm"));
  const std::string command = fmt::format("{} calibrate {} d.csv -o c.yaml", robot_program, sample_arm);
  const Outcome refused = folder.run(command);
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(refused.err.find("--accept-suspicion angles_radians takes them as they stand"), std::string::npos)
      << refused.err;
  EXPECT_FALSE(std::filesystem::exists(folder.file("c.yaml")));
  const Outcome other = folder.run(command + " --accept-suspicion joint1_sign");
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_FALSE(std::filesystem::exists(folder.file("c.yaml")));
}

// The points of another arm: discover() would take the difference for effects.
TEST(RobotWords, DiscoverWarnsOfMeasurementsThatTheDescriptionCannotMean) {
  const Folder folder;
  const std::string other = LLMT_ROBOTS "/ur5.yaml";
  ASSERT_EQ(folder.run(fmt::format("{} simulate {} --poses 60 -o d.csv", robot_program, other)).exit_code, 0);
  const Outcome outcome = folder.run(fmt::format("{} discover {} d.csv", robot_program, sample_arm));
  EXPECT_NE(outcome.err.find("this description does not belong to these measurements"), std::string::npos)
      << outcome.err;
  const Outcome own = folder.run(fmt::format("{} discover {} {}", robot_program, sample_arm, sample_measured));
  EXPECT_EQ(own.err, "");
}

TEST(RobotWords, LimitsHaveAUnitAndFewDigits) {
  const Folder folder;
  std::string robot = llmt::read_file(sample_arm);
  const std::string limits = "limits_deg: [-170, 170]";
  robot.replace(robot.find(limits), limits.size(), "limits_deg: [-166.15776058793872, 166.15776058793872]");
  folder.write("arm.yaml", robot);
  std::string text = llmt::read_file(sample_measured);
  const std::size_t row = text.find('\n') + 1;
  text.replace(row, text.find(',', row) - row, "9.5");
  folder.write("d.csv", text);
  const Outcome run = folder.run(robot_program + " calibrate arm.yaml d.csv --folds 0");
  EXPECT_NE(run.out.find("3 of 150 values of joint1 lie outside its limits, -166.2 to 166.2 deg (-166.3 to 544.3 deg "
                         "measured)"),
            std::string::npos)
      << run.out;
}

TEST(RobotWords, DescriptionsInUtf16AreRefusedAsThat) {
  const Folder folder;
  folder.write("arm.yaml", std::string("\xFF\xFEn\0a\0", 6));
  EXPECT_EQ(folder.run(robot_program + " simulate arm.yaml").err,
            "llmt-robot: arm.yaml: this is UTF-16, UTF-8 is needed\n");
}

}  // namespace
