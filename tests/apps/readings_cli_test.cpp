// Tables of other programs, and what calibrate says of them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "apps/programs.hpp"
#include "llmt/files.hpp"

namespace {

using llmt::read_file;
using program::Folder;
using program::Outcome;
using program::robot_program;
using program::sample_arm;
using program::sample_measured;

// The sample as another program may write it: semicolons, decimal commas, other names, metres.
std::string exported() {
  std::string text = read_file(sample_measured);
  const std::size_t end = text.find('\n');
  std::string body = text.substr(end);
  for (char& c : body) c = c == ',' ? ';' : c == '.' ? ',' : c;
  return "J1;J2;J3;J4;J5;J6;X;Y;Z" + body;
}

const char* const columns = R"(decimal: comma
columns: {J1: q1_rad, J2: q2_rad, J3: q3_rad, J4: q4_rad, J5: q5_rad, J6: q6_rad, X: x_mm, Y: y_mm, Z: z_mm}
)";

TEST(Readings, AColumnMapReadsTheTableOfAnotherProgram) {
  const Folder folder;
  folder.write("exported.csv", exported());
  folder.write("columns.yaml", columns);
  for (const std::string command : {"calibrate", "discover"}) {
    const Outcome plain =
        folder.run(fmt::format("{} {} {} {} --json", robot_program, command, sample_arm, sample_measured));
    const Outcome mapped = folder.run(
        fmt::format("{} {} {} exported.csv --columns columns.yaml --json", robot_program, command, sample_arm));
    EXPECT_EQ(mapped.exit_code, 0) << mapped.err;
    // What calibrate prints begins with the names of the files.
    const auto figures = [](const std::string& text) {
      return program::without_record(text.substr(std::min(text.find("\"errors\""), text.size())));
    };
    EXPECT_EQ(figures(mapped.out), figures(plain.out)) << command;
    if (command == "discover") {
      EXPECT_EQ(program::without_record(mapped.out), program::without_record(plain.out));
    }
  }
  folder.write("columns.yaml", "columns: {K1: q1_rad}\n");
  const Outcome wrong =
      folder.run(fmt::format("{} calibrate {} exported.csv --columns columns.yaml", robot_program, sample_arm));
  EXPECT_EQ(wrong.exit_code, 1);
  EXPECT_NE(wrong.err.find("exported.csv:1: there is no column \"K1\""), std::string::npos) << wrong.err;
}

TEST(Readings, TheVerdictComesFirstAndQualityOnRequest) {
  const Folder folder;
  const Outcome plain = folder.run(fmt::format("{} calibrate {} {}", robot_program, sample_arm, sample_measured));
  EXPECT_NE(plain.out.find("\nCalibrated: the mean position error falls from "), std::string::npos) << plain.out;
  EXPECT_EQ(plain.out.find("observability"), std::string::npos);
  const Outcome more =
      folder.run(fmt::format("{} calibrate {} {} --quality", robot_program, sample_arm, sample_measured));
  for (const char* part : {"each pose left out in turn", "observability: O1", "Would more poses help?", "geometry"}) {
    EXPECT_NE(more.out.find(part), std::string::npos) << part << "\n" << more.out;
  }
  std::string few = read_file(sample_measured);
  std::size_t end = 0;
  for (int line = 0; line < 10; ++line) end = few.find('\n', end) + 1;
  folder.write("few.csv", few.substr(0, end));
  const Outcome too_few = folder.run(fmt::format("{} calibrate {} few.csv --folds 3", robot_program, sample_arm));
  const std::size_t warning = too_few.out.find("\nWARNING: ");
  EXPECT_LT(warning, too_few.out.find("parameter ")) << too_few.out;
  EXPECT_EQ(too_few.out.find("Calibrated:"), std::string::npos) << too_few.out;
}

TEST(Readings, RobustNamesTheLinesThatItLeavesOut) {
  const Folder folder;
  std::string text = read_file(sample_measured);
  std::size_t begin = 0;
  for (int line = 1; line < 12; ++line) begin = text.find('\n', begin) + 1;
  const std::size_t end = text.find('\n', begin);
  const std::size_t last = text.rfind(',', end);
  text.replace(last + 1, end - last - 1, "0.5");
  folder.write("lost.csv", text);
  const Outcome outcome = folder.run(fmt::format("{} calibrate {} lost.csv --robust", robot_program, sample_arm));
  EXPECT_NE(outcome.out.find("more than four times as far off as the median: line 12\n"), std::string::npos)
      << outcome.out;
}

TEST(Readings, APriorHoldsItsParameter) {
  const Folder folder;
  const Outcome held = folder.run(
      fmt::format("{} calibrate {} {} --prior joint2.a=1e-6 --json", robot_program, sample_arm, sample_measured));
  EXPECT_EQ(held.exit_code, 0) << held.err;
  for (const auto& parameter : nlohmann::json::parse(held.out).at("parameters")) {
    if (parameter.at("name") == "joint2.a") {
      EXPECT_NEAR(parameter.at("value").get<double>(), 160.0, 1e-4);
    }
  }
  for (const std::string prior : {"joint2.a", "joint2.a=x", "joint2.a=-1", "joint9.a=1"}) {
    const Outcome wrong =
        folder.run(fmt::format("{} calibrate {} {} --prior {}", robot_program, sample_arm, sample_measured, prior));
    EXPECT_EQ(wrong.exit_code, 2) << prior << wrong.err;
    EXPECT_NE(wrong.err.find(prior.substr(0, 8)), std::string::npos) << wrong.err;
  }
}

TEST(Readings, OrientationsNeedToBeInTheFile) {
  const Folder folder;
  const Outcome none =
      folder.run(fmt::format("{} calibrate {} {} --orientations", robot_program, sample_arm, sample_measured));
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_NE(none.err.find("no orientation was measured"), std::string::npos) << none.err;
}

// Frames of sessions are found again by their names, and a session that the calibration did not see is not taken for
// one.
TEST(Readings, SessionsOfATestFileAreFoundByTheirNames) {
  const Folder folder;
  const std::string text = read_file(sample_measured);
  const auto in_session = [&](const std::string& name, std::size_t first, std::size_t count) {
    std::istringstream lines(text);
    std::string line;
    std::getline(lines, line);
    std::string out = line + ",session\n";
    for (std::size_t row = 0; std::getline(lines, line); ++row) {
      if (row >= first && row < first + count) out += line + "," + name + "\n";
    }
    return out;
  };
  folder.write("mon.csv", in_session("mon", 0, 60));
  folder.write("more.csv", in_session("mon", 60, 30));
  folder.write("wed.csv", in_session("wed", 60, 30));
  const std::string fit = fmt::format("{} calibrate {} mon.csv --folds 0 ", robot_program, sample_arm);
  EXPECT_EQ(folder.run(fit + "--test more.csv").exit_code, 0);
  const Outcome unknown = folder.run(fit + "--test wed.csv");
  EXPECT_EQ(unknown.exit_code, 1);
  EXPECT_NE(unknown.err.find("wed.csv:2: session \"wed\" was not part of the calibration"), std::string::npos)
      << unknown.err;
  EXPECT_EQ(folder.run(fit + "--test wed.csv --new-session").exit_code, 0);
}

TEST(Readings, TouchesThatTellNothingAreNamed) {
  const Folder folder;
  folder.write("few.csv", "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,sphere\n1,2,3,4,5,6,a\n2,3,4,5,6,7,b\n");
  const Outcome few = folder.run(fmt::format("{} calibrate {} few.csv", robot_program, sample_arm));
  EXPECT_EQ(few.exit_code, 1);
  EXPECT_EQ(
      few.err,
      "llmt-robot: few.csv: 2 of 2 sessions, sockets, planes and spheres left out, too few points in each to find "
      "where it is: sphere a, sphere b (lines 2, 3)\n");
}

}  // namespace
