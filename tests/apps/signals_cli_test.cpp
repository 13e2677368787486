#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/program.hpp"
#include "llmt/csv.hpp"
#include "llmt/random.hpp"

namespace {

using nlohmann::json;
using program::Folder;
using program::Outcome;

const std::string signals = LLMT_PROGRAM " signals ";
const std::string on_log = signals + "log.csv --time t --position q1,q2 --torque u1,u2 --cutoff 10";

double q1(double t) { return 0.8 * std::sin(3.0 * t); }
double q2(double t) { return 0.5 * std::cos(2.0 * t); }

// 10 s at 500 Hz in two runs: two joints and their torques u = 2 dq. `edit` changes a line.
void write_log(const Folder& folder, const std::function<void(int, std::string&)>& edit = {}) {
  llmt::Random random(1);
  std::string text = "run,t,q1,q2,u1,u2,\"load, kg\"\n";
  for (int i = 0; i < 5000; ++i) {
    const double t = 0.002 * (i % 2500);
    std::string line =
        fmt::format("{},{},{},{},{},{},{}\n", i < 2500 ? "one" : "two", t, q1(t) + 1e-5 * random.normal(), q2(t),
                    4.8 * std::cos(3.0 * t), -2.0 * std::sin(2.0 * t), i < 2500 ? 5 : 8);
    if (edit) edit(i, line);
    text += line;
  }
  folder.write("log.csv", text);
}

TEST(LlmtSignals, WritesATableWhoseColumnsAreTheDerivatives) {
  const Folder folder;
  write_log(folder);
  const Outcome outcome = folder.run(on_log + " --group run --keep '\"load, kg\"' -o table.csv --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  const json report = json::parse(outcome.out);
  const llmt::Csv table = llmt::Csv::read(folder.file("table.csv"));
  EXPECT_EQ(table.columns(),
            (std::vector<std::string>{"run",        "t",          "q1",       "q2",        "dq1",
                                      "dq2",        "ddq1",       "ddq2",     "u1",        "u2",
                                      "load, kg",   "noise_q1",   "noise_q2", "noise_dq1", "noise_dq2",
                                      "noise_ddq1", "noise_ddq2", "noise_u1", "noise_u2",  "cutoff_hz"}));
  EXPECT_EQ(report["columns"].get<std::vector<std::string>>(), table.columns());
  EXPECT_EQ(report["rows"], table.rows());
  EXPECT_EQ(report["runs"].size(), 2U);
  EXPECT_EQ(report["runs"][1]["first_line"], 2502);
  EXPECT_EQ(report["runs"][1]["last_line"], 5001);
  EXPECT_NEAR(report["rate_hz"].get<double>(), 500.0, 1e-6);
  EXPECT_NEAR(report["noise_in_log"]["q1"].get<double>(), 1e-5, 1e-6);
  const std::vector<std::string> runs = table.texts("run");
  const Eigen::MatrixXd numbers = table.numbers(std::vector<std::string>{"t", "dq1", "ddq2", "u1", "load, kg"});
  EXPECT_GT(table.rows(), 100);
  const double noise = report["noise"]["dq1"];
  EXPECT_TRUE((table.numbers("noise_dq1").array() == noise).all());
  EXPECT_TRUE((table.numbers("cutoff_hz").array() == 10.0).all());
  EXPECT_GT(noise, 0.0);
  EXPECT_LT(noise, 0.01);
  for (Eigen::Index i = 0; i < numbers.rows(); ++i) {
    EXPECT_NEAR(numbers(i, 1), 2.4 * std::cos(3.0 * numbers(i, 0)), 5.0 * noise);
    EXPECT_NEAR(numbers(i, 2), -2.0 * std::cos(2.0 * numbers(i, 0)), 1e-4);
    EXPECT_NEAR(numbers(i, 3), 4.8 * std::cos(3.0 * numbers(i, 0)), 1e-4);
    EXPECT_EQ(numbers(i, 4), runs[i] == "one" ? 5.0 : 8.0);
  }
}

TEST(LlmtSignals, SaysWhatItDidInAShortText) {
  const Folder folder;
  write_log(folder);
  const Outcome outcome = folder.run(on_log + " --group run --independent -o table.csv");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_FALSE(llmt::Csv::read(folder.file("table.csv")).has("cutoff_hz"));
  for (const char* words : {"from 5000 samples of log.csv at 500", "2 runs without a gap", "low pass of 10",
                            "Ends: ", "Rows: ", "Standstill: ", "Written to table.csv", "noise in the log"}) {
    EXPECT_NE(outcome.out.find(words), std::string::npos) << words << " in " << outcome.out;
  }
}

TEST(LlmtSignals, ALogWithoutTimeHasARate) {
  const Folder folder;
  write_log(folder, [](int i, std::string& line) {
    if (i >= 2500) line.clear();
  });
  ASSERT_EQ(folder.run(on_log + " -o a.csv").exit_code, 0);
  const std::string by_rate = signals + "log.csv --rate 500 --position q1,q2 --torque u1,u2 --cutoff 10 -o b.csv";
  ASSERT_EQ(folder.run(by_rate).exit_code, 0);
  const std::vector<std::string> names = {"t", "q1", "ddq1", "u2"};
  const Eigen::MatrixXd a = llmt::Csv::read(folder.file("a.csv")).numbers(names);
  const Eigen::MatrixXd b = llmt::Csv::read(folder.file("b.csv")).numbers(names);
  ASSERT_EQ(a.rows(), b.rows());
  EXPECT_LT((a - b).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(LlmtSignals, RefusesWhatItCannotUseWithFileLineAndColumn) {
  const Folder folder;
  const auto refused = [&](const std::string& command, const std::string& words) {
    const Outcome outcome = folder.run(command + " -o table.csv");
    EXPECT_NE(outcome.exit_code, 0) << command;
    EXPECT_NE(outcome.err.find(words), std::string::npos) << words << " in " << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(folder.file("table.csv")));
  };
  write_log(folder);
  refused(on_log, "log.csv:2502: time is 0 after 4.998, must increase");
  refused(on_log, "within a run");
  const std::string uncut = signals + "log.csv --time t --position q1,q2 --torque u1,u2 --group run";
  refused(uncut + " --cutoff 126", "at most a quarter of the sampling rate: 125 Hz");
  refused(uncut + " --cutoff 0", "--cutoff");
  refused(uncut + " --cutoff 0.5", "the filter cuts 5.2");
  refused(on_log + " --group run --standstill 0.1,0.2,0.3", "3 speeds for 2 positions");
  refused(on_log + " --group run --keep q1", "\"q1\"");
  refused(signals + "log.csv --position q1 --cutoff 10", "--time");
  refused(signals + "log.csv --time t --rate 500 --position q1 --cutoff 10", "--rate");
  refused(signals + "log.csv --time t --position q9 --cutoff 10", "q9");
  write_log(folder, [](int i, std::string& line) {
    if (i == 40) line = "one,0.08,nan,0,0,0,5\n";
  });
  refused(on_log + " --group run", "log.csv:42: column \"q1\"");
  std::string renamed = "t,q1,dq1\n";
  for (int i = 0; i < 900; ++i) renamed += fmt::format("{},{},0\n", 0.002 * i, i);
  folder.write("named.csv", renamed);
  refused(signals + "named.csv --time t --position q1 --torque dq1 --cutoff 10",
          "two columns of the table would be called \"dq1\": the velocity of \"q1\", and a torque");
}

}  // namespace
