// What the program says of readings that lie far off, and how it keeps errors of the instrument apart from the arm's.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>

#include "apps/programs.hpp"
#include "llmt/csv.hpp"
#include "llmt/files.hpp"

namespace {

using llmt::read_file;
using program::Folder;
using program::Outcome;
using program::robot_program;
using program::sample_arm;
using program::sample_measured;

TEST(ArmAlone, ReadingsFarOffAreNamedByTheirLines) {
  const Folder folder;
  const llmt::Csv table = llmt::Csv::parse(read_file(sample_measured), "m.csv");
  const Eigen::VectorXd x = table.numbers(table.columns()[6]);
  ASSERT_EQ(table.columns()[6], "x_mm");
  std::string text = read_file(sample_measured);
  for (const Eigen::Index row : {9, 49, 89}) {
    // Of the line, from its seventh field on.
    std::size_t at = 0;
    for (Eigen::Index line = 1; line < table.line_of(row); ++line) at = text.find('\n', at) + 1;
    for (int comma = 0; comma < 6; ++comma) at = text.find(',', at) + 1;
    text.replace(at, text.find(',', at) - at, fmt::format("{}", x(row) + 30.0));
  }
  folder.write("far.csv", text);
  const Outcome run = folder.run(fmt::format("{} calibrate {} far.csv", robot_program, sample_arm));
  EXPECT_NE(run.out.find("Note: 3 of 150 readings lie far off"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("(lines 11, 51, 91): --robust leaves such readings out"), std::string::npos) << run.out;
  const Outcome robust = folder.run(fmt::format("{} calibrate {} far.csv --robust", robot_program, sample_arm));
  EXPECT_EQ(robust.out.find("far off and make"), std::string::npos) << robust.out;
  const Outcome clean = folder.run(fmt::format("{} calibrate {} {}", robot_program, sample_arm, sample_measured));
  EXPECT_EQ(clean.out.find("far off"), std::string::npos) << clean.out;
}

TEST(ArmAlone, DiscoverRemembersTheErrorOfPosesSetAside) {
  const Folder folder;
  const Outcome run =
      folder.run(fmt::format("{} discover {} {} -o improved.yaml", robot_program, sample_arm, sample_measured));
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const std::string text = read_file(folder.file("improved.yaml"));
  EXPECT_NE(text.find("held_out_mm"), std::string::npos) << text;
  EXPECT_NE(text.find("held_out_sd_mm"), std::string::npos);
}

TEST(ArmAlone, AUrdfCannotBeChecked) {
  const Folder folder;
  folder.write("arm.urdf", "<robot/>");
  const Outcome run = folder.run(fmt::format("{} check arm.urdf {}", robot_program, sample_measured));
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.err.find("give the description (YAML) that calibrate or discover wrote"), std::string::npos) << run.err;
}

TEST(ArmAlone, ErrorsOfTheInstrumentAreNotThoseOfTheArm) {
  const Folder folder;
  folder.write("drifts.yaml", read_file(sample_arm) +
                                  "effects:\n"
                                  "  - {type: drift, from: 0, to: 10, vx_mm: 5, vy_mm: 0, vz_mm: 0}\n"
                                  "  - {type: instrument_range, offset_mm: 1}\n");
  folder.run(fmt::format("{} simulate {} --poses 10 -o poses.csv", robot_program, sample_arm));
  const auto predicted = [&](const std::string& arguments) {
    return folder.run(fmt::format("{} predict {} poses.csv", robot_program, arguments));
  };
  const Outcome plain = predicted(sample_arm);
  const Outcome alone = predicted("drifts.yaml");
  ASSERT_EQ(alone.exit_code, 0) << alone.err;
  EXPECT_EQ(alone.out, plain.out);
  EXPECT_NE(alone.err.find("errors of the measurement and not of the arm: drift"), std::string::npos) << alone.err;
  const Outcome measured = predicted("drifts.yaml --as-measured");
  ASSERT_EQ(measured.exit_code, 0) << measured.err;
  EXPECT_NE(measured.err.find("the table does not have: order"), std::string::npos) << measured.err;
  const llmt::Csv read = llmt::Csv::parse(measured.out, "out.csv");
  const llmt::Csv arm = llmt::Csv::parse(plain.out, "out.csv");
  EXPECT_GT((read.numbers("x_mm") - arm.numbers("x_mm")).cwiseAbs().maxCoeff(), 3.0);
  // A program of commands does not follow a drift, either.
  folder.run(fmt::format("{} predict {} poses.csv -o targets.csv", robot_program, sample_arm));
  const Outcome commands = folder.run(fmt::format("{} compensate drifts.yaml targets.csv", robot_program));
  EXPECT_EQ(commands.exit_code, 0) << commands.err;
  EXPECT_EQ(commands.out.find("time_s"), std::string::npos);
}

}  // namespace
