// llmt discover on rows in time: their times and runs as columns, and what was found applied to other runs.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "apps/program.hpp"
#include "llmt/csv.hpp"
#include "llmt/random.hpp"

namespace discover_time_test {
namespace {

using nlohmann::json;
using program::Folder;
using program::Outcome;

const std::string discover = LLMT_PROGRAM " discover ";
constexpr double step = 0.02;  // s

// Position, velocity and acceleration of a sum of sines.
std::array<double, 3> motion(double t, int run) {
  std::array<double, 3> x{};
  for (int k = 0; k < 5; ++k) {
    const double omega = 2.0 * std::numbers::pi * (0.1 + 0.15 * k);
    const double phase = omega * t + 1.3 * k + 0.9 * run;
    const double size = 0.3 / (1.0 + k);
    x[0] += size * std::sin(phase);
    x[1] += size * omega * std::cos(phase);
    x[2] -= size * omega * omega * std::sin(phase);
  }
  return x;
}

double needed(const std::array<double, 3>& x) { return 40.0 * x[0] + x[1] + 3.0 * x[2]; }

// Writes NAME_s.csv and NAME_m.csv: a mass on a spring, in `runs` runs. The measured force is late by `delay` s, and
// has drag dq |dq| besides.
void write_log(const Folder& folder, const std::string& name, int runs, int rows, double delay, double drag,
               std::uint64_t seed) {
  llmt::Random random(seed);
  std::string simulated = "t,run,q,dq,ddq,u\n";
  std::string measured = simulated;
  for (int run = 0; run < runs; ++run) {
    for (int i = 0; i < rows; ++i) {
      const double t = step * i;
      const std::array<double, 3> x = motion(t, run);
      const double u = needed(motion(t - delay, run)) + drag * x[1] * std::abs(x[1]) + 0.02 * random.normal();
      const std::string same = fmt::format("{},\"run {}\",{},{},{}", t, run + 1, x[0], x[1], x[2]);
      simulated += fmt::format("{},{}\n", same, needed(x));
      measured += fmt::format("{},{}\n", same, u);
    }
  }
  folder.write(name + "_s.csv", simulated);
  folder.write(name + "_m.csv", measured);
}

Eigen::VectorXd column(const Folder& folder, const std::string& file, const std::string& name) {
  return llmt::Csv::read(folder.file(file)).numbers(name);
}

// A torque with dry friction, of which a load behind a spring of 6 Hz takes 60 %; in single steps of 0.5 ms.
void write_ringing_log(const Folder& folder, const std::string& name, std::uint64_t seed) {
  llmt::Random random(seed);
  const double phase = random.uniform(0.0, 6.0);
  constexpr double omega = 2.0 * std::numbers::pi * 6.0;
  constexpr double zeta = 0.08;
  constexpr double h = 5e-4;
  constexpr int steps = 40;
  std::string simulated = "t,q,dq,ddq,u\n";
  std::string measured = simulated;
  double z = 0.0;
  double speed = 0.0;
  for (int i = 0; i < 1000 * steps; ++i) {
    const double t = h * i;
    double q[3] = {0.0, 0.0, 0.0};
    for (const double frequency : {0.15, 0.4, 0.7}) {
      const double w = 2.0 * std::numbers::pi * frequency;
      q[0] += 0.3 * std::sin(w * t + phase * frequency);
      q[1] += 0.3 * w * std::cos(w * t + phase * frequency);
      q[2] -= 0.3 * w * w * std::sin(w * t + phase * frequency);
    }
    const double u = 40.0 * q[0] + q[1] + 3.0 * q[2] + (q[1] < 0.0 ? -8.0 : 8.0);
    if (i == 0) z = u / (omega * omega);
    const double acceleration = u - 2.0 * zeta * omega * speed - omega * omega * z;
    if (i % steps == 0) {
      const std::string inputs = fmt::format("{:.4f},{:.9g},{:.9g},{:.9g}", t, q[0], q[1], q[2]);
      simulated += fmt::format("{},{:.9g}\n", inputs, u);
      measured += fmt::format("{},{:.9g}\n", inputs, u - 0.6 * acceleration + 0.2 * random.normal());
    }
    speed += h * acceleration;
    z += h * speed;
  }
  folder.write(name + "_s.csv", simulated);
  folder.write(name + "_m.csv", measured);
}

const std::string in_time = " -t u --time t --group run ";

TEST(DiscoverInTime, CorrectedTablesKeepTimesAndRuns) {
  const Folder folder;
  write_log(folder, "log", 2, 300, 0.0, 1.5, 1);
  const Outcome search = folder.run(discover + "log_s.csv log_m.csv" + in_time + "-o c.csv --json > found.json");
  ASSERT_EQ(search.exit_code, 0) << search.err;
  const llmt::Csv corrected = llmt::Csv::read(folder.file("c.csv"));
  EXPECT_EQ(corrected.columns(),
            (std::vector<std::string>{"t", "run", "q", "dq", "ddq", "u_simulated", "u_corrected", "u_measured"}));
  EXPECT_EQ(corrected.texts("run"), llmt::Csv::read(folder.file("log_m.csv")).texts("run"));
  EXPECT_EQ(column(folder, "c.csv", "t"), column(folder, "log_m.csv", "t"));
  const json found = json::parse(llmt::read_file(folder.file("found.json")));
  EXPECT_EQ(found["time"]["column"], "t");
  EXPECT_EQ(found["time"]["group"], "run");
  EXPECT_EQ(found["time"]["filtered"], false);  // these rows went through no filter
}

TEST(DiscoverInTime, ApplyPrintsTheGapOfEachRun) {
  const Folder folder;
  write_log(folder, "log", 2, 300, 0.0, 15.0, 1);
  write_log(folder, "other", 3, 200, 0.0, 15.0, 2);
  ASSERT_EQ(folder.run(discover + "log_s.csv log_m.csv" + in_time + "--json > found.json").exit_code, 0);
  const Outcome applied = folder.run(discover + "--apply found.json other_s.csv other_m.csv -o c.csv");
  ASSERT_EQ(applied.exit_code, 0) << applied.err;
  for (const char* label : {"all", "run 1", "run 2", "run 3"}) {
    EXPECT_NE(applied.out.find(fmt::format("u       {:<5}", label)), std::string::npos) << label << applied.out;
  }
  const json gaps = json::parse(folder.run(discover + "--apply found.json other_s.csv other_m.csv --json").out);
  ASSERT_EQ(gaps["runs"].size(), 3U);
  double squares = 0.0;
  for (const json& gap : gaps["runs"]) squares += std::pow(gap["after"].get<double>(), 2.0) / 3.0;
  EXPECT_NEAR(std::sqrt(squares), gaps["gap"][0]["after"].get<double>(), 1e-9);
  EXPECT_LT(gaps["gap"][0]["after"].get<double>(), 0.2 * gaps["gap"][0]["before"].get<double>());
  // A machine without drag; and one run of it among others.
  write_log(folder, "free", 1, 200, 0.0, 0.0, 3);
  for (const char* file : {"s", "m"}) {
    folder.run(fmt::format("(cat other_{0}.csv; sed '1d; s/run 1/run 4/' free_{0}.csv) > mixed_{0}.csv", file));
  }
  const Outcome mixed = folder.run(discover + "--apply found.json mixed_s.csv mixed_m.csv");
  EXPECT_NE(mixed.out.find("The gap of u is larger with what was found in the run \"run 4\": it does not hold there."),
            std::string::npos)
      << mixed.out;
  const Outcome grown = folder.run(discover + "--apply found.json free_s.csv free_m.csv");
  EXPECT_NE(grown.out.find("The gap of u is larger with what was found: it does not hold for these rows."),
            std::string::npos)
      << grown.out;
}

TEST(DiscoverInTime, ADelayIsAppliedToOtherRunsByTheirTimes) {
  const Folder folder;
  constexpr double delay = 0.012;
  write_log(folder, "log", 2, 500, delay, 0.0, 1);
  write_log(folder, "other", 3, 300, delay, 0.0, 2);
  ASSERT_EQ(folder.run(discover + "log_s.csv log_m.csv" + in_time + "-o c.csv --json > found.json").exit_code, 0);
  const json found = json::parse(llmt::read_file(folder.file("found.json")));
  ASSERT_EQ(found["effects"].size(), 1U) << found;
  EXPECT_EQ(found["effects"][0]["name"], "delay");
  // At the rows of the search it is what the search has written, and elsewhere it is the delay.
  ASSERT_EQ(folder.run(discover + "--apply found.json log_s.csv -o again.csv").exit_code, 0);
  EXPECT_LT((column(folder, "again.csv", "u_corrected") - column(folder, "c.csv", "u_corrected")).cwiseAbs().maxCoeff(),
            1e-9);
  const json gaps = json::parse(folder.run(discover + "--apply found.json other_s.csv other_m.csv --json").out);
  EXPECT_LT(gaps["gap"][0]["after"].get<double>(), 0.3 * gaps["gap"][0]["before"].get<double>());
  EXPECT_LT(gaps["gap"][0]["after"].get<double>(), 0.025);
  // Times and runs under other names; none at all; too few rows.
  folder.run("sed 's/^t,run/seconds,trial/' other_s.csv > named.csv");
  ASSERT_EQ(folder.run(discover + "--apply found.json named.csv -o n.csv --time seconds --group trial").exit_code, 0);
  ASSERT_EQ(folder.run(discover + "--apply found.json other_s.csv -o o.csv").exit_code, 0);
  EXPECT_EQ(column(folder, "n.csv", "u_corrected"), column(folder, "o.csv", "u_corrected"));
  const Outcome without = folder.run(discover + "--apply found.json named.csv -o n.csv");
  EXPECT_EQ(without.exit_code, 1);
  EXPECT_NE(without.err.find("named.csv: there is no column \"t\", as in the search; terms of found.json depend on the "
                             "past of a run (--time COLUMN names it)"),
            std::string::npos)
      << without.err;
  folder.run("head -20 other_s.csv > few.csv");
  const Outcome few = folder.run(discover + "--apply found.json few.csv -o n.csv");
  EXPECT_EQ(few.exit_code, 1);
  EXPECT_NE(few.err.find("the term delay depends on the past and cannot be computed at these rows"), std::string::npos)
      << few.err;
}

// What has a past leads to a model that has one, by a command that runs as it is printed.
TEST(DiscoverInTime, AnInnerStateNamesTheCommandOfAModelThatMoves) {
  const Folder folder;
  write_log(folder, "log", 2, 200, 0.012, 0.0, 1);
  const std::string text = folder.run(discover + "log_s.csv log_m.csv" + in_time).out;
  const std::size_t begin = text.find("Next: llmt fit ");
  ASSERT_NE(begin, std::string::npos) << text;
  const std::string words = text.substr(begin + 15, text.find('\n', begin) - begin - 15);
  EXPECT_EQ(words, "log_m.csv --target u --inputs q,dq,ddq --lags auto --time t --groups run -o model.json");
  const Outcome fitted = folder.run(LLMT_PROGRAM " fit " + words);
  EXPECT_EQ(fitted.exit_code, 0) << fitted.err;
  write_log(folder, "drag", 2, 200, 0.0, 0.5, 1);
  EXPECT_EQ(folder.run(discover + "drag_s.csv drag_m.csv" + in_time).out.find("Next: "), std::string::npos);
}

// A load of 60 % of the torque rings behind its spring at each reversal.
TEST(DiscoverInTime, AResonanceIsAppliedToOtherRows) {
  const Folder folder;
  write_ringing_log(folder, "log", 1);
  write_ringing_log(folder, "other", 2);
  const std::string named = " -t u --inputs q,dq,ddq --time t ";
  ASSERT_EQ(folder.run(discover + "log_s.csv log_m.csv" + named + "-o c.csv --json > found.json").exit_code, 0);
  const json found = json::parse(llmt::read_file(folder.file("found.json")));
  EXPECT_EQ(found["effects"][0]["name"], "resonance") << found["effects"];
  ASSERT_EQ(folder.run(discover + "--apply found.json log_s.csv -o again.csv").exit_code, 0);
  EXPECT_LT((column(folder, "again.csv", "u_corrected") - column(folder, "c.csv", "u_corrected")).cwiseAbs().maxCoeff(),
            1e-6);
  const json gaps = json::parse(folder.run(discover + "--apply found.json other_s.csv other_m.csv --json").out);
  EXPECT_LT(gaps["gap"][0]["after"].get<double>(), 0.4 * gaps["gap"][0]["before"].get<double>());
}

TEST(DiscoverInTime, RowsThatDoNotBelongTogetherAreNotCompared) {
  const Folder folder;
  write_log(folder, "log", 1, 300, 0.012, 0.0, 1);
  write_log(folder, "other", 1, 300, 0.012, 0.0, 2);
  folder.run("awk -F, -v OFS=, 'NR > 1 { $1 = 1000 * $1 } 1' other_s.csv > ms.csv");
  folder.run("awk -F, -v OFS=, 'NR == 9 { $1 = 0.12 } 1' other_s.csv > twice.csv");
  folder.run("(head -1 log_m.csv; sed 1d log_m.csv | tac) > backwards.csv");
  ASSERT_EQ(folder.run(discover + "log_s.csv log_m.csv" + in_time + "--json > found.json").exit_code, 0);
  struct Case {
    std::string arguments;
    std::string message;
  };
  const std::vector<Case> cases = {
      {"log_s.csv backwards.csv", "rows must stand in the same order in both files"},
      {"twice.csv -o o.csv",
       "found.json: the term delay depends on when the rows were taken, but data rows 7 and 8 have the time 0.12; rows "
       "of a run are taken one after the other"},
      {"ms.csv -o o.csv",
       "found.json: the term delay was found in rows that are 0.0200 apart; these are 20.0 apart: times must have the "
       "unit of the search"},
  };
  for (const Case& entry : cases) {
    const Outcome outcome = folder.run(discover + "--apply found.json " + entry.arguments);
    EXPECT_EQ(outcome.exit_code, 1) << entry.arguments << outcome.out;
    EXPECT_NE(outcome.err.find(entry.message), std::string::npos) << entry.arguments << "\n" << outcome.err;
  }
}

TEST(DiscoverInTime, ACommandGetsTimesAndRuns) {
  const Folder folder;
  write_log(folder, "log", 2, 300, 0.0, 1.5, 1);
  folder.write("mass.awk",
               "BEGIN { FS = \",\" }\n"
               "NR == 1 { for (i = 1; i <= NF; ++i) at[$i] = i; print \"u\"; next }\n"
               "$at[\"t\"] == \"\" || $at[\"run\"] !~ /^run [12]$/ { exit 3 }\n"
               "{ printf \"%.10g\\n\", 40 * $at[\"q\"] + $at[\"dq\"] + $at[\"mass\"] * $at[\"ddq\"] }\n");
  const Outcome outcome =
      folder.run(discover + "log_m.csv" + in_time + "--parameter mass=3 --simulate 'awk -f mass.awk' --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(json::parse(outcome.out)["effects"][0]["name"], "signed_square");
}

TEST(DiscoverInTime, MistakesInTimesAreNamedWithTheirLines) {
  const Folder folder;
  write_log(folder, "log", 2, 60, 0.0, 1.5, 1);
  folder.run("awk -F, -v OFS=, 'NR > 1 { $1 = 1000 * $1 } 1' log_s.csv > ms.csv");
  folder.run("awk -F, -v OFS=, 'NR > 1 { $1 = $1 + 1000 } 1' log_s.csv > later.csv");
  folder.run("awk -F, -v OFS=, 'NR == 3 { $1 = \"2026-01-01\" } 1' log_m.csv > date.csv");
  folder.run("awk -F, -v OFS=, 'NR == 9 { $1 = 0.12 } 1' log_m.csv > twice.csv");
  struct Case {
    std::string arguments;
    std::string message;
  };
  const std::vector<Case> cases = {
      {"log_s.csv log_m.csv -t u --inputs q,dq --time t",
       "log_m.csv:62: column \"t\" is 0, as in line 2; rows of a run are taken one after the other (--group COLUMN"},
      {"log_s.csv twice.csv -t u --inputs q,dq --time t --group run",
       "twice.csv:9: column \"t\" is 0.12, as in line 8; rows of a run are taken one after the other\n"},
      {"log_s.csv date.csv -t u --inputs q,dq --time t --group run",
       "date.csv:3: column \"t\": '2026-01-01' is not a number (--time takes numbers"},
      {"ms.csv log_m.csv -t u --inputs q,dq --time t --group run",
       "log_m.csv:3: column \"t\" is 0.02 after the first row, but 20 in ms.csv; rows must stand in the same order in "
       "both files, and times have one unit"},
  };
  for (const Case& entry : cases) {
    const Outcome outcome = folder.run(discover + entry.arguments);
    EXPECT_EQ(outcome.exit_code, 1) << entry.arguments << outcome.out;
    EXPECT_NE(outcome.err.find(entry.message), std::string::npos) << entry.arguments << "\n" << outcome.err;
  }
  // A clock of its own is no mistake.
  EXPECT_EQ(folder.run(discover + "later.csv log_m.csv -t u --inputs q,dq,ddq --time t --group run").exit_code, 0);
}

TEST(DiscoverInTime, AColumnThatWasNotMeasuredIsNoted) {
  const Folder folder;
  write_log(folder, "log", 1, 200, 0.0, 0.0, 1);
  folder.run("awk -F, -v OFS=, 'NR > 1 { $6 = 0 } 1' log_m.csv > zero.csv");
  const Outcome outcome = folder.run(discover + "log_s.csv zero.csv" + in_time);
  EXPECT_NE(outcome.out.find("u was measured as 0 at every row, whatever was simulated: check the column"),
            std::string::npos)
      << outcome.out;
}

}  // namespace
// Every time of the range is one that a run may take.
TEST(DiscoverSimulate, TheLongestTimeIsAsLongAsIsSaid) {
  const Folder folder;
  folder.write("m.csv", "x,y\n1,2\n2,4\n3,7\n");
  for (const char* seconds : {"9.2e9", "9.3e9", "1e10", "1e300"}) {
    const Outcome outcome = folder.run(fmt::format(
        "{} m.csv -t y --simulate-seconds {} --simulate 'sleep 0.2; exit 3' --parameter p=1", discover, seconds));
    EXPECT_EQ(outcome.exit_code, 1) << seconds;
    EXPECT_NE(outcome.err.find("it ended with exit code 3"), std::string::npos) << outcome.err;
  }
}

}  // namespace discover_time_test
