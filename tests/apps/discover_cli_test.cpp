#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>

#include "apps/program.hpp"
#include "llmt/csv.hpp"
#include "llmt/random.hpp"

namespace {

using nlohmann::json;
using program::Folder;
using program::Outcome;

const std::string discover = LLMT_PROGRAM " discover ";

struct Inputs {
  double t;
  double a;
  double b;
};

// Writes s.csv and m.csv: y = 3 + 2 a - 4 b simulated, `hidden` and normal noise of 0.05 in what was measured.
void write_tables(const Folder& folder, int rows, const std::function<double(const Inputs&)>& hidden,
                  std::uint64_t seed = 1) {
  llmt::Random random(seed);
  std::string simulated = "t,a,b,y\n";
  std::string measured = "note,t,a,b,y\n";
  for (int i = 0; i < rows; ++i) {
    const Inputs row{0.5 * i, random.uniform(-2.0, 5.0), random.uniform()};
    const double y = 3.0 + 2.0 * row.a - 4.0 * row.b;
    simulated += fmt::format("{},{},{},{}\n", row.t, row.a, row.b, y);
    measured += fmt::format("row {},{},{},{},{}\n", i, row.t, row.a, row.b, y + hidden(row) + 0.05 * random.normal());
  }
  folder.write("s.csv", simulated);
  folder.write("m.csv", measured);
}

double step_and_settling(const Inputs& row) { return (row.a > 3.2 ? 0.3 : 0.0) + 0.5 * std::exp(-row.t / 12.0); }

double parameter(const json& effect, const std::string& name, const std::string& field = "value") {
  for (const json& entry : effect["parameters"]) {
    if (entry["name"] == name) return entry[field];
  }
  ADD_FAILURE() << "no parameter " << name;
  return 0.0;
}

TEST(LlmtDiscover, NamesWhatIsMissingAndCorrectsIt) {
  const Folder folder;
  write_tables(folder, 200, step_and_settling);
  const std::string command = discover + "s.csv m.csv --inputs a,b,t --target y";
  const Outcome outcome = folder.run(command + " -o c.csv --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  const json report = json::parse(outcome.out);
  EXPECT_EQ(report["verdict"], "named");
  ASSERT_EQ(report["effects"].size(), 2U);
  const json& step = report["effects"][report["effects"][0]["name"] == "step" ? 0 : 1];
  const json& settling = report["effects"][report["effects"][0]["name"] == "step" ? 1 : 0];
  EXPECT_EQ(step["location"], "a");
  EXPECT_EQ(settling["location"], "t");
  EXPECT_NEAR(parameter(step, "height"), 0.3, 4.0 * parameter(step, "height", "std_error"));
  EXPECT_NEAR(parameter(step, "c"), 3.2, 2.0 * parameter(step, "c", "std_error"));
  EXPECT_NEAR(parameter(settling, "tau"), 12.0, 4.0 * parameter(settling, "tau", "std_error"));
  EXPECT_NEAR(parameter(settling, "A"), 0.5, 4.0 * parameter(settling, "A", "std_error"));
  for (const json& effect : report["effects"]) {
    EXPECT_EQ(effect["confirmed"], true);
    EXPECT_EQ(effect["rivals"], json::array());
    EXPECT_GT(effect["share"], 0.1);
  }
  EXPECT_EQ(report["unknown"], nullptr);
  EXPECT_EQ(report["gap"]["heldout_samples"], 40);
  EXPECT_GT(report["gap"]["before"], 0.15);
  EXPECT_LT(report["gap"]["after"], 0.07);
  EXPECT_NEAR(report["gap"]["noise_floor"], 0.05, 0.01);
  EXPECT_GE(report["regions"].size(), 2U);

  const llmt::Csv corrected = llmt::Csv::read(folder.file("c.csv"));
  EXPECT_EQ(corrected.columns(), (std::vector<std::string>{"a", "b", "t", "y_simulated", "y_corrected", "y_measured"}));
  EXPECT_EQ(corrected.rows(), 200);
  const Eigen::VectorXd after = corrected.numbers("y_corrected") - corrected.numbers("y_measured");
  EXPECT_LT(std::sqrt(after.squaredNorm() / 200.0), 0.07);

  const Outcome text = folder.run(command);
  for (const std::string expected :
       {"VERDICT: 2 terms are missing: ", "step of a", "settling of t", "Gap on the 40 rows set aside", "t <= "}) {
    EXPECT_NE(text.out.find(expected), std::string::npos) << expected << "\n" << text.out;
  }
  EXPECT_EQ(folder.run(command).out, text.out);
  EXPECT_EQ(folder.run(command + " --json").out, folder.run(command + " --json --held-out 0.2 --seed 1").out);
}

TEST(LlmtDiscover, NothingMissingSaysWhatWouldHaveBeenSeen) {
  const Folder folder;
  write_tables(folder, 100, [](const Inputs&) { return 0.0; });
  const Outcome text = folder.run(discover + "s.csv m.csv --target y");
  EXPECT_EQ(text.exit_code, 0);
  EXPECT_NE(text.out.find("nothing is missing that these rows could show"), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("Smallest terms that would have been found"), std::string::npos);
  const json report = json::parse(folder.run(discover + "s.csv m.csv --target y --json").out);
  EXPECT_EQ(report["verdict"], "nothing missing");
  EXPECT_EQ(report["effects"], json::array());
  EXPECT_GT(report["smallest_visible"].size(), 10U);
  EXPECT_LT(report["smallest_visible"][0]["rms"], 0.1);
}

TEST(LlmtDiscover, OwnTermsAreTriedUnderTheirNames) {
  const Folder folder;
  write_tables(folder, 200, [](const Inputs& row) { return 0.4 * std::sqrt(row.b) * std::sin(row.a); });
  folder.write("terms.txt",
               "# what we suspect\nslip = sqrt(b) * sin(a)   # per load\nheat = b^2 * t\nlinear_b = 2 * b\n");
  const json report = json::parse(folder.run(discover + "s.csv m.csv --target y --terms terms.txt --json").out);
  ASSERT_EQ(report["effects"].size(), 1U);
  EXPECT_EQ(report["effects"][0]["name"], "slip");
  EXPECT_EQ(report["effects"][0]["formula"], "sqrt(b) * sin(a)");
  EXPECT_NEAR(parameter(report["effects"][0], "coefficient"), 0.4, 0.05);
  const json own =
      json::parse(folder.run(discover + "s.csv m.csv --target y --terms terms.txt --own-terms-only --json").out);
  EXPECT_EQ(own["effects"][0]["name"], "slip");
  EXPECT_LT(own["hypotheses"], report["hypotheses"]);
}

TEST(LlmtDiscover, WhatNoTermExplainsIsUnknown) {
  const Folder folder;
  write_tables(folder, 200, [](const Inputs& row) { return 0.5 * std::exp(-std::pow((row.a - 1.0) / 0.7, 2)); });
  const json report = json::parse(folder.run(discover + "s.csv m.csv --target y --json").out);
  EXPECT_EQ(report["verdict"], "unknown effect");
  EXPECT_EQ(report["unknown"]["acts_on"], "y");
  EXPECT_EQ(report["unknown"]["depends_on"], (json{"a"}));
  EXPECT_EQ(report["unknown"]["per_turn"], nullptr);
  EXPECT_LT(report["gap"]["after"], 0.07);
}

TEST(LlmtDiscover, TheSimulationMayAdjustItself) {
  const Folder folder;
  write_tables(folder, 150, [](const Inputs& row) { return 0.7 + 0.02 * (3.0 + 2.0 * row.a - 4.0 * row.b); });
  const std::string command = discover + "s.csv m.csv --target y --json";
  EXPECT_EQ(json::parse(folder.run(command).out)["effects"].size(), 2U);
  const json adjusted = json::parse(folder.run(command + " --allow offset,scale").out);
  EXPECT_EQ(adjusted["verdict"], "parameters only");
  EXPECT_NEAR(adjusted["simulation"][0]["value"], 0.7, 0.05);
  EXPECT_NEAR(adjusted["simulation"][1]["value"], 1.02, 0.005);
  ASSERT_EQ(adjusted["not_testable"].size(), 2U);
  EXPECT_EQ(adjusted["not_testable"][0]["effect"], "offset");
}

TEST(LlmtDiscover, TheOrderOfMeasurementIsAnInput) {
  const Folder folder;
  llmt::Random random(5);
  const std::vector<Eigen::Index> order = random.permutation(160);
  std::string simulated = "x,y\n";
  std::string measured = "x,when,y\n";
  std::vector<double> x(160);
  for (double& value : x) value = random.uniform(-1.0, 1.0);
  std::vector<std::size_t> row_at(160);
  for (std::size_t i = 0; i < 160; ++i) row_at[order[i]] = i;
  for (std::size_t i = 0; i < 160; ++i) {
    const auto when = order[i];
    const double before = when > 0 ? x[row_at[when - 1]] : x[i];
    simulated += fmt::format("{},{}\n", x[i], x[i]);
    measured += fmt::format("{},{},{}\n", x[i], when, x[i] + (x[i] > before ? 0.2 : -0.2) + 0.02 * random.normal());
  }
  folder.write("s.csv", simulated);
  folder.write("m.csv", measured);
  const json report = json::parse(folder.run(discover + "s.csv m.csv --inputs x --target y --order when --json").out);
  ASSERT_EQ(report["effects"].size(), 1U);
  EXPECT_EQ(report["effects"][0]["name"], "direction");
  EXPECT_EQ(report["effects"][0]["location"], "x");
  EXPECT_NEAR(parameter(report["effects"][0], "coefficient"), 0.2, 0.02);
}

TEST(LlmtDiscover, SeveralOutputsInDifferentUnits) {
  const Folder folder;
  llmt::Random random(3);
  std::string simulated = "a,b,y,z\n";
  std::string measured = simulated;
  for (int i = 0; i < 120; ++i) {
    const double a = random.uniform(-1.0, 1.0);
    const double b = random.uniform(-1.0, 1.0);
    simulated += fmt::format("{},{},{},{}\n", a, b, a, 1000.0 * (a + b));
    measured += fmt::format("{},{},{},{}\n", a, b, a + 0.1 * a * b + 0.01 * random.normal(),
                            1000.0 * (a + b) + 20.0 * b * b + 5.0 * random.normal());
  }
  folder.write("s.csv", simulated);
  folder.write("m.csv", measured);
  const json report = json::parse(folder.run(discover + "s.csv m.csv --target y,z --json").out);
  ASSERT_EQ(report["effects"].size(), 2U);
  for (const json& effect : report["effects"]) {
    EXPECT_EQ(effect["name"], effect["output"] == "y" ? "product" : "square");
  }
  EXPECT_NEAR(report["gap"]["outputs"][0]["noise_floor"], 0.01, 0.003);
  EXPECT_NEAR(report["gap"]["outputs"][1]["noise_floor"], 5.0, 1.5);
}

TEST(LlmtDiscover, OddDataHaveASaneVerdict) {
  const Folder folder;
  write_tables(folder, 100, [](const Inputs&) { return 0.0; });
  const json same = json::parse(folder.run(discover + "s.csv s.csv --target y --json").out);
  EXPECT_EQ(same["verdict"], "nothing missing");
  EXPECT_EQ(same["gap"]["before"], 0.0);

  llmt::Random random(2);
  std::string simulated = "c,a,twin,y\n";
  std::string measured = simulated;
  for (int i = 0; i < 100; ++i) {
    const double a = random.uniform(-1.0, 1.0);
    simulated += fmt::format("7,{},{},{}\n", a, 2.0 * a, a);
    measured +=
        fmt::format("7,{},{},{}\n", a, 2.0 * a, a + 0.3 * a * a + (i == 17 ? 5.0 : 0.0) + 0.02 * random.normal());
  }
  folder.write("s.csv", simulated);
  folder.write("m.csv", measured);
  const json report = json::parse(folder.run(discover + "s.csv m.csv --target y --held-out 0 --json").out);
  EXPECT_EQ(report["verdict"], "named, indistinguishable");
  ASSERT_EQ(report["effects"].size(), 1U);
  EXPECT_EQ(report["effects"][0]["exact_alias"], true);
  EXPECT_EQ(report["outliers"], (json{17}));
  EXPECT_EQ(report["outlier_lines"], (json{19}));
  EXPECT_EQ(report["gap"]["before"], nullptr);
  EXPECT_EQ(report["not_testable"].back()["effect"], "c");
  EXPECT_EQ(report["not_testable"].back()["why"], "the input is constant");
}

// What stands between ```language and ``` for the k-th time.
std::string block(const std::string& page, const std::string& language, int k) {
  std::size_t begin = 0;
  for (; k > 0; --k) begin = page.find("```" + language + "\n", begin) + language.size() + 4;
  return page.substr(begin, page.find("```\n", begin) - begin);
}

TEST(LlmtDiscover, PrintsWhatThePageSays) {
  const Folder folder;
  const std::string page = llmt::read_file(LLMT_DOCS "/discovery-generic.md");
  ASSERT_EQ(folder.run(block(page, "sh", 1)).exit_code, 0);
  std::string command = block(page, "sh", 2);
  ASSERT_TRUE(command.starts_with("llmt discover "));
  command.replace(0, std::string("llmt discover ").size(), discover);
  EXPECT_EQ(folder.run(command).out, block(page, "text", 1));
}

TEST(LlmtDiscover, RowsOfALogAreMeansOverBlocks) {
  const Folder folder;
  // Three sines, noise that is alike in neighbours, and nothing missing.
  llmt::Random random(3);
  std::string simulated = "time,run,x,v,y\n";
  std::string measured = simulated;
  double noise = 0.0;
  for (int i = 0; i < 1000; ++i) {
    const double t = 0.02 * i;
    const double x = std::sin(t) + 0.5 * std::sin(2.3 * t + 1.0) + 0.3 * std::sin(3.1 * t);
    const double v = std::cos(t) + 1.15 * std::cos(2.3 * t + 1.0) + 0.93 * std::cos(3.1 * t);
    noise = 0.9 * noise + 0.1 * random.normal();
    simulated += fmt::format("{},run {},{},{},{}\n", t, i / 200, x, v, x + v);
    measured += fmt::format("{},run {},{},{},{}\n", t, i / 200, x, v, x + v + noise);
  }
  folder.write("s.csv", simulated);
  folder.write("m.csv", measured);
  const std::string command = discover + "s.csv m.csv --target y --time time --group run";
  const Outcome text = folder.run(command);
  EXPECT_NE(text.out.find("1000 rows, inputs x, v\n"), std::string::npos) << text.out << text.err;
  EXPECT_NE(text.out.find("Rows in time, 0.0200 in time apart: "), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("VERDICT: nothing is missing beyond noise"), std::string::npos) << text.out;
  const json report = json::parse(folder.run(command + " --json").out);
  EXPECT_EQ(report["gap"]["heldout_samples"], 200);  // one run of five
  EXPECT_GT(report["time"]["rows_per_sample"], 1);
  EXPECT_LT(report["time"]["independent_share"], 0.9);
  EXPECT_FALSE(report["time"]["found_out"]);
}

TEST(LlmtDiscover, MistakesHaveTheirExitCodeAndMessage) {
  const Folder folder;
  write_tables(folder, 60, step_and_settling);
  folder.write("empty.csv", "");
  folder.write("header.csv", "t,a,b,y\n");
  folder.write("one.csv", "t,a,b,y\n0,1,2,3\n");
  folder.write("nan.csv", "t,a,b,y\n0,1,2,3\n1,nan,2,3\n");
  folder.write("word.csv", "t,a,b,y\n0,1,2,3\n1,1,2,high\n");
  folder.write("short.csv", "t,a,y\n0,1,3\n");
  folder.write("two.csv", "t,a,b,y\n0,1,2,3\n1,1,2,3\n");
  folder.write("other.csv", "t,a,b,y\n0,1,2,3\n1,1.5,2,3\n");
  folder.write("same.csv", "t,a,b,y\n" +
                               std::string("1,1,2,3\n1,1,2,3\n1,1,2,3\n1,2,2,3\n1,1,2,3\n1,1,5,3\n1,1,2,3\n") +
                               "1,1,2,3\n1,1,2,3\n1,1,2,3\n1,1,2,3\n1,1,2,3\n1,1,2,3\n1,1,2,3\n1,1,2,3\n");
  folder.write("bad1.txt", "slip = a * b\n\nslip\n");
  folder.write("bad2.txt", "slip = a * (b\n");
  folder.write("bad3.txt", "# q\nslip = a * q\n");
  folder.write("bad4.txt", "slip = log(b - 10)\n");
  folder.write("bad5.txt", "slip = a\nslip = b\n");
  folder.write("bad6.txt", "square = a\n");
  folder.write("bad7.txt", "2x = a\n");
  folder.write("bad8.txt", "\xEF\xBB\xBF# a byte-order mark is no part of a name\nslip = (a = 7)\n");
  folder.write("bad9.txt", "\xEF\xBB\xBFslip = b\nslip = a\n");
  struct Case {
    std::string arguments;
    int exit_code;
    std::string message;
  };
  const std::vector<Case> cases = {
      {"s.csv --target y", 2, "measured"},
      {"s.csv m.csv", 2, "--target"},
      {"s.csv m.csv --target y --held-out 1.5", 2, "--held-out"},
      {"s.csv m.csv --target y --allow slope", 2, "--allow"},
      {"s.csv m.csv --target y --inputs a,a", 2, "\"a\" is given twice"},
      {"s.csv m.csv --target y --inputs a,y", 2, "\"y\" is an output and cannot be an input"},
      {"s.csv m.csv --target y --own-terms-only", 2, "--terms"},
      {"s.csv m.csv --target y --time y", 2, "\"y\" is an output and cannot be the time or the group"},
      {"s.csv m.csv --target y --time t --order t", 2, "--order is not needed beside it"},
      {"s.csv m.csv --target y --group t", 2, "--group needs --time"},
      {"s.csv m.csv --target y --time q", 1, "\"q\""},
      {"s.csv m.csv --target y --only lineal", 2, "there is no family \"lineal\" among the terms to try: absolute, "},
      {"s.csv m.csv --target y --without lineal", 2, "there is no family \"lineal\""},
      {"no.csv m.csv --target y", 1, "no.csv: cannot be read"},
      {"empty.csv m.csv --target y", 1, "empty.csv: "},
      {"header.csv m.csv --target y", 1, "header.csv: no rows"},
      {"one.csv one.csv --target y", 1, "one.csv: "},
      {"two.csv one.csv --target y", 1, "two.csv has 2 rows, one.csv has 1"},
      {"two.csv nan.csv --target y", 1, "nan.csv:3: column \"a\""},
      {"two.csv word.csv --target y", 1, "word.csv:3: column \"y\""},
      {"two.csv other.csv --target y", 1, "other.csv:3: column \"a\" is 1.5, but 1 at two.csv:3"},
      {"one.csv short.csv --target y", 1, "short.csv"},
      {"s.csv m.csv --target z", 1, "\"z\""},
      {"s.csv m.csv --target y --inputs a,q", 1, "\"q\""},
      {"s.csv m.csv --target y --order when", 1, "\"when\""},
      {"same.csv same.csv --target y --order a", 1, "the order \"a\" has the value 1 twice"},
      {"s.csv m.csv --target y --terms no.txt", 1, "no.txt: cannot be read"},
      {"s.csv m.csv --target y --terms bad1.txt", 1, "bad1.txt:3: not of the form name = expression"},
      {"s.csv m.csv --target y --terms bad2.txt", 1, "bad2.txt:1: slip: column"},
      {"s.csv m.csv --target y --terms bad3.txt", 1, "bad3.txt:2: slip: \"q\" is not an input; there are t, a, b, y"},
      {"s.csv m.csv --target y --terms bad4.txt", 1,
       "bad4.txt:1: slip: \"log(b - 10)\" is not a finite number at data row 1"},
      {"s.csv m.csv --target y --terms bad5.txt", 1, "bad5.txt:2: the name \"slip\" is there twice"},
      {"s.csv m.csv --target y --terms bad6.txt", 1, "bad6.txt:1: \"square\" is the name of a built-in term"},
      {"s.csv m.csv --target y --terms bad7.txt", 1, "bad7.txt:1: the name \"2x\" is not a word"},
      {"s.csv m.csv --target y --terms bad8.txt", 1,
       "bad8.txt:2: slip: column 4 of \"(a = 7)\": == compares; = is not allowed"},
      {"s.csv m.csv --target y --terms bad9.txt", 1, "bad9.txt:2: the name \"slip\" is there twice"},
      {"s.csv m.csv --target y -o no/c.csv", 1, "no/c.csv: cannot be written"},
  };
  for (const Case& entry : cases) {
    const Outcome outcome = folder.run(discover + entry.arguments);
    EXPECT_EQ(outcome.exit_code, entry.exit_code) << entry.arguments << "\n" << outcome.err;
    EXPECT_NE(outcome.err.find(entry.message), std::string::npos) << entry.arguments << "\n" << outcome.err;
    EXPECT_EQ(outcome.out, "") << entry.arguments;
  }
}

}  // namespace
