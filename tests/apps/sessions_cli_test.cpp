// Sessions in tables, the limit of an acceptance, and the nominal arm of a compensation.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "apps/programs.hpp"

namespace sessions {

using program::Folder;
using program::Outcome;
using program::robot_program;

const std::string samples = std::string(LLMT_ROOT) + "/docs/samples/";

// Joins two tables, with the name of a session in every row.
std::string with_sessions(const std::string& monday, const std::string& tuesday) {
  std::string text;
  for (const auto& [table, name] : {std::pair{monday, "monday"}, std::pair{tuesday, "tuesday"}}) {
    std::istringstream lines(table);
    std::string line;
    std::getline(lines, line);
    if (text.empty()) text = "session," + line + "\n";
    while (std::getline(lines, line)) text += fmt::format("{},{}\n", name, line);
  }
  return text;
}

// The arm of the samples without effects, on two days: `moved.yaml` is it with the instrument elsewhere.
void write_arms(const Folder& folder) {
  std::string text = llmt::read_file(samples + "arm_true.yaml");
  text = text.substr(0, text.find("\neffects:")) + "\n";
  folder.write("real.yaml", text);
  const std::size_t base = text.find("xyz_mm: [", text.find("base:"));
  ASSERT_NE(base, std::string::npos);
  folder.write("moved.yaml", text.replace(base, text.find(']', base) - base, "xyz_mm: [900, -2500, 300"));
}

void simulate(const Folder& folder, const std::string& description, int poses, int seed, const std::string& to) {
  const Outcome run = folder.run(fmt::format("{} simulate {} --poses {} --noise-um 20 --seed {} -o {}", robot_program,
                                             description, poses, seed, to));
  ASSERT_EQ(run.exit_code, 0) << run.err;
}

// Both arms measured, and calibrated as one file of two sessions: two.yaml.
void calibrate_two_days(const Folder& folder) {
  write_arms(folder);
  simulate(folder, "real.yaml", 60, 1, "a.csv");
  simulate(folder, "moved.yaml", 60, 2, "b.csv");
  folder.write("two.csv", with_sessions(llmt::read_file(folder.file("a.csv")), llmt::read_file(folder.file("b.csv"))));
  ASSERT_EQ(folder.run(fmt::format("{} calibrate {}arm.yaml two.csv -o two.yaml", robot_program, samples)).exit_code,
            0);
}

std::vector<std::vector<std::string>> cells_of(const std::string& csv) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream lines(csv);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream rest(line);
    rows.emplace_back();
    for (std::string cell; std::getline(rest, cell, ',');) rows.back().push_back(cell);
  }
  return rows;
}

TEST(SessionsProgram, PredictPutsEveryRowIntoTheFrameOfItsSession) {
  const Folder folder;
  calibrate_two_days(folder);
  simulate(folder, "real.yaml", 3, 5, "c.csv");
  simulate(folder, "moved.yaml", 3, 6, "d.csv");
  folder.write("new.csv", with_sessions(llmt::read_file(folder.file("c.csv")), llmt::read_file(folder.file("d.csv"))));
  const Outcome run = folder.run(robot_program + " predict two.yaml new.csv");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto rows = cells_of(run.out);
  const auto truth = cells_of(llmt::read_file(folder.file("new.csv")));
  ASSERT_EQ(rows.size(), 7U);
  const auto column = [](const std::vector<std::string>& header, const char* name) {
    return std::ranges::find(header, name) - header.begin();
  };
  for (std::size_t i = 1; i < rows.size(); ++i) {
    for (const char* axis : {"x_mm", "y_mm", "z_mm"}) {
      EXPECT_NEAR(std::stod(rows[i][column(rows[0], axis)]), std::stod(truth[i][column(truth[0], axis)]), 0.2)
          << i << axis;
    }
    EXPECT_EQ(rows[i][column(rows[0], "session")], i <= 3 ? "\"monday\"" : "\"tuesday\"");
  }
  folder.run("sed s/tuesday/sunday/ new.csv > sunday.csv");
  const Outcome unknown = folder.run(robot_program + " predict two.yaml sunday.csv");
  EXPECT_EQ(unknown.exit_code, 1);
  EXPECT_NE(unknown.err.find("sunday.csv:5: column \"session\": the robot was not calibrated with the session "
                             "\"sunday\"; it knows monday, tuesday"),
            std::string::npos)
      << unknown.err;
}

TEST(SessionsProgram, ATestFileOfAnotherSessionIsNoErrorOfTheArm) {
  const Folder folder;
  write_arms(folder);
  simulate(folder, "real.yaml", 60, 1, "a.csv");
  simulate(folder, "moved.yaml", 40, 2, "b.csv");
  const std::string calibrate = fmt::format("{} calibrate {}arm.yaml a.csv --test b.csv", robot_program, samples);
  const Outcome run = folder.run(calibrate + " -o c.yaml");
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.err.find("the file is of another session; --new-session fits them"), std::string::npos) << run.err;
  EXPECT_FALSE(std::filesystem::exists(folder.file("c.yaml")));
  EXPECT_EQ(folder.run(calibrate + " --new-session").exit_code, 0);
}

TEST(SessionsProgram, ATestFileThatTookPartIsSaid) {
  const Folder folder;
  write_arms(folder);
  simulate(folder, "real.yaml", 60, 1, "a.csv");
  simulate(folder, "real.yaml", 40, 2, "b.csv");
  std::filesystem::copy_file(folder.file("a.csv"), folder.file("copy.csv"));
  for (const std::string command : {"calibrate", "discover"}) {
    const auto run = [&](const std::string& test) {
      const std::string words = fmt::format("{} {} {}arm.yaml a.csv", robot_program, command, samples);
      const Outcome outcome = folder.run(fmt::format("{} --test {} 2>&1", words, test));
      return outcome.out + outcome.err;
    };
    const std::string same = run("copy.csv");
    EXPECT_NE(same.find("60 of the 60 test readings stand among the measurements"), std::string::npos) << same;
    EXPECT_EQ(run("b.csv").find("stand among"), std::string::npos);
  }
}

TEST(SessionsProgram, ALimitIsPassedFailedOrNotEvaluated) {
  const Folder folder;
  write_arms(folder);
  simulate(folder, "real.yaml", 60, 1, "a.csv");
  const auto run = [&](const std::string& options) {
    return folder.run(fmt::format("{} calibrate {}arm.yaml a.csv {}", robot_program, samples, options));
  };
  const Outcome pass = run("--limit-mm 0.5");
  EXPECT_EQ(pass.exit_code, 0) << pass.err;
  EXPECT_NE(pass.out.find("PASS: the mean error on poses left out is 0.0"), std::string::npos) << pass.out;
  const Outcome fail = run("--limit-mm 0.001");
  EXPECT_EQ(fail.exit_code, 1);
  EXPECT_NE(fail.out.find("FAIL: "), std::string::npos) << fail.out;
  EXPECT_EQ(run("--limit-mm 0.5 --folds 0").exit_code, 4);
  const Outcome as_json = run("--limit-mm 0.001 --json");
  EXPECT_EQ(nlohmann::json::parse(as_json.out)["limit"]["verdict"], "fail");
  EXPECT_EQ(run("--limit-mm -1").exit_code, 2);
}

TEST(SessionsProgram, CompensateSummaryHasLinesAndTheFramesOfTheNominalArm) {
  const Folder folder;
  write_arms(folder);
  simulate(folder, "real.yaml", 80, 1, "a.csv");
  ASSERT_EQ(folder.run(fmt::format("{} calibrate {}arm.yaml a.csv -o c.yaml", robot_program, samples)).exit_code, 0);
  folder.run("cut -d, -f1-6 a.csv | head -30 > program.csv");
  const std::string command =
      fmt::format("{} compensate c.yaml program.csv --nominal {}arm.yaml", robot_program, samples);
  const Outcome run = folder.run(command);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.err.find("\\x0a"), std::string::npos) << run.err;
  EXPECT_NE(run.err.find("\nMean distance from the targets"), std::string::npos) << run.err;
  // Base and tool fitted to the nominal arm leave as much as its calibration with these alone.
  const nlohmann::json frames = nlohmann::json::parse(
      folder.run(fmt::format("{} calibrate {}arm.yaml a.csv --json", robot_program, samples)).out);
  const double nominal = frames["errors"]["nominal"]["in_sample_mm"]["mean"];
  const nlohmann::json summary = nlohmann::json::parse(folder.run(command + " --json -o x.csv").out);
  EXPECT_NEAR(summary["mean_before_mm"].get<double>(), nominal, 0.2 * nominal);
}

TEST(SessionsProgram, ExportTakesTheFramesOfASessionOrRefuses) {
  const Folder folder;
  calibrate_two_days(folder);
  const Outcome tuesday = folder.run(robot_program + " export two.yaml --c --session tuesday -o t.c");
  EXPECT_EQ(tuesday.exit_code, 0) << tuesday.err;
  EXPECT_NE(tuesday.out.find("positions of the tool, in the frame of the instrument in the session tuesday"),
            std::string::npos)
      << tuesday.out;
  EXPECT_NE(llmt::read_file(folder.file("t.h")).find("in the frame of the instrument in the session tuesday"),
            std::string::npos);
  const Outcome monday = folder.run(robot_program + " export two.yaml --c -o m.c");
  EXPECT_NE(monday.out.find("in the session monday"), std::string::npos) << monday.out;
  EXPECT_NE(llmt::read_file(folder.file("t.c")), llmt::read_file(folder.file("m.c")));
  const Outcome unknown = folder.run(robot_program + " export two.yaml --kinematics --session sunday");
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_NE(unknown.err.find("the robot was not calibrated with the session \"sunday\"; it knows monday, tuesday"),
            std::string::npos)
      << unknown.err;
}

TEST(SessionsProgram, ACalibrationSaysWhatItWasMadeFrom) {
  const Folder folder;
  write_arms(folder);
  simulate(folder, "real.yaml", 60, 1, "a.csv");
  const std::string command = fmt::format(
      "SOURCE_DATE_EPOCH=86400 {} calibrate {}arm.yaml a.csv --robust --instrument 'AT960, 750123' --serial-number 7 "
      "-o c.yaml",
      robot_program, samples);
  const Outcome run = folder.run(command + " --json");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const nlohmann::json made = nlohmann::json::parse(run.out)["made_from"];
  EXPECT_EQ(made["date"], "1970-01-02");
  EXPECT_EQ(made["program"].get<std::string>().substr(0, 11), "llmt-robot ");
  EXPECT_EQ(made["options"], nlohmann::json({"--robust"}));
  EXPECT_EQ(made["instrument"], "AT960, 750123");
  EXPECT_EQ(made["serial_number"], "7");
  // By another program: coreutils.
  const std::string sum = folder.run("sha256sum a.csv").out.substr(0, 64);
  ASSERT_EQ(made["files"].size(), 2U);
  EXPECT_EQ(made["files"][1], nlohmann::json({{"role", "measurements"}, {"name", "a.csv"}, {"sha256", sum}}));
  const std::string yaml = llmt::read_file(folder.file("c.yaml"));
  EXPECT_NE(yaml.find(sum), std::string::npos) << yaml;
  // The file can be used, and threads and names of outputs do not change it.
  EXPECT_EQ(folder.run(robot_program + " check c.yaml a.csv --same-session").exit_code, 0);
  ASSERT_EQ(folder.run(command + " --threads 1 --plot p.svg --json >/dev/null; mv c.yaml d.yaml; " + command).exit_code,
            0);
  EXPECT_EQ(llmt::read_file(folder.file("c.yaml")), yaml);
  // A pipe has no bytes to sum up a second time.
  const Outcome piped =
      folder.run(fmt::format("cat a.csv | {} calibrate {}arm.yaml /dev/stdin --json", robot_program, samples));
  ASSERT_EQ(piped.exit_code, 0) << piped.err;
  EXPECT_EQ(nlohmann::json::parse(piped.out)["made_from"]["files"][1]["sha256"], "not known: no regular file");
}

TEST(SessionsProgram, PosesBeyondTheCalibratedRangesAreNamed) {
  const Folder folder;
  write_arms(folder);
  simulate(folder, "real.yaml", 60, 1, "a.csv");
  ASSERT_EQ(folder.run(fmt::format("{} calibrate {}arm.yaml a.csv -o c.yaml", robot_program, samples)).exit_code, 0);
  folder.run("cut -d, -f1-6 a.csv | head -4 | sed '1s/$/,payload_kg/; 2s/$/,40/; 3,4s/$/,0/' > p.csv");
  const Outcome run = folder.run(robot_program + " predict c.yaml p.csv");
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_NE(run.err.find("1 of 3 poses lie beyond the calibrated ranges: payload from 0 to 40 kg, calibrated from "),
            std::string::npos)
      << run.err;
  EXPECT_NE(run.err.find("; positions of the tool, in the frame of the instrument"), std::string::npos) << run.err;
  folder.run("cut -d, -f1-6 a.csv | head -4 > q.csv");
  EXPECT_EQ(folder.run(robot_program + " predict c.yaml q.csv").err.find("beyond"), std::string::npos);
}

}  // namespace sessions
