// The steps of a readable tree, what its print keeps to, and its exports as a user gets them.
#include <fmt/format.h>

#include <Eigen/Core>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "apps/printed_rules.hpp"
#include "apps/programs.hpp"
#include "llmt/csv.hpp"
#include "llmt/files.hpp"
#include "llmt/random.hpp"

namespace {

using nlohmann::json;
using printed::PrintedRules;
using printed::Row;
using printed::rows;
using printed::text_of;
using program::Folder;
using program::llmt_program;
using program::Outcome;

TEST(ReadableSteps, EveryStepIsPrintedAndCanBeTaken) {
  const Folder folder;
  llmt::Random random(9);
  std::string text = "a,b,y\n";
  for (int i = 0; i < 500; ++i) {
    const double a = random.uniform(0.0, 6.0);
    const double b = random.uniform(-1.0, 1.0);
    text += fmt::format("{},{},{}\n", a, b, 3.0 * std::sin(1.5 * a) + b + 0.2 * random.normal());
  }
  folder.write("d.csv", text);
  const Outcome fitted = folder.run(llmt_program + " fit d.csv -t y --readable -o m.json");
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  const json summary = json::parse(folder.run(llmt_program + " fit d.csv -t y --readable --json").out);
  const json& readable = summary["readable"][0];
  ASSERT_GE(readable["path"].size(), 3u);
  std::istringstream lines(fitted.out.substr(fitted.out.find("above the model")));
  std::string line;
  std::getline(lines, line);
  for (std::size_t k = 0; k < readable["path"].size(); ++k) {
    const json& step = readable["path"][k];
    if (step["leaves"] > 12 && k != readable["taken"]) continue;
    std::getline(lines, line);
    std::istringstream words(line.substr(line.find_first_of(" 0123456789")));
    int rules = 0, terms = 0, size = 0;
    double rmse = 0.0, above = 0.0;
    words >> rules >> terms >> size >> rmse >> above;
    EXPECT_EQ(rules, step["leaves"]) << line;
    EXPECT_EQ(terms, step["most_terms"]) << line;
    EXPECT_EQ(size, step["size"]) << line;
    EXPECT_NEAR(above, 100.0 * step["above_model"].get<double>(), 0.51) << line;
    EXPECT_EQ(line.find("taken") != std::string::npos, k == readable["taken"]) << line;
  }
  for (const json& sentence : readable["sentences"])
    EXPECT_NE(fitted.out.find(sentence.get<std::string>()), std::string::npos) << sentence;
  const int rules = readable["path"][1]["leaves"];
  const Outcome taken =
      folder.run(fmt::format("{} fit d.csv -t y --readable-rules {} -o few.json", llmt_program, rules));
  ASSERT_EQ(taken.exit_code, 0) << taken.err;
  EXPECT_NE(taken.out.find("as asked"), std::string::npos) << taken.out;
  EXPECT_EQ(PrintedRules(folder.run(llmt_program + " inspect few.readable.json --rules").out).count(),
            static_cast<std::size_t>(rules));
}

TEST(ReadableSteps, BeyondADozenRulesNoShortTreeIsNear) {
  const Folder folder;
  llmt::Random random(10);
  std::string text = "a,y\n";
  for (int i = 0; i < 1500; ++i) {
    const double a = random.uniform(0.0, 20.0);
    text +=
        fmt::format("{},{}\n", a, std::floor(a) * (static_cast<int>(a) % 2 == 0 ? 1.0 : -1.0) + 0.1 * random.normal());
  }
  folder.write("d.csv", text);
  const Outcome fitted = folder.run(llmt_program + " fit d.csv -t y --readable --validity crisp");
  EXPECT_NE(fitted.out.find("rules are more than a person reads: no short tree is near."), std::string::npos)
      << fitted.out;
  const Outcome few = folder.run(llmt_program + " fit d.csv -t y --readable-rules 5 --validity crisp");
  EXPECT_EQ(few.out.find("no short tree is near"), std::string::npos) << few.out;
}

TEST(ReadableSteps, KeepsAMonotoneInput) {
  const Folder folder;
  llmt::Random random(11);
  std::string text = "a,b,y\n";
  std::string asked = "a,b\n";
  for (int i = 0; i < 400; ++i) {
    const double a = random.uniform(0.0, 10.0);
    const double b = random.uniform(-1.0, 1.0);
    text += fmt::format("{},{},{}\n", a, b,
                        (a > 6.0 ? 8.0 : a) - (a > 3.0 && a < 4.0 ? 3.0 : 0.0) + b + 0.3 * random.normal());
    asked += fmt::format("{},0.3\n", 0.03 * i - 1.0);
  }
  folder.write("d.csv", text);
  folder.write("asked.csv", asked);
  const Outcome fitted = folder.run(llmt_program + " fit d.csv -t y --readable --monotone a -o m.json");
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  ASSERT_EQ(folder.run(llmt_program + " predict m.readable.json asked.csv -o p.csv").exit_code, 0);
  const Eigen::VectorXd y = llmt::Csv::read(folder.file("p.csv")).numbers("y_pred");
  EXPECT_GT(y(399) - y(0), 3.0);
  EXPECT_LE((y.head(399) - y.tail(399)).maxCoeff(), 1e-12);
}

TEST(ReadableSteps, InputsFarFromZeroAreCountedFromTheirMiddle) {
  const Folder folder;
  llmt::Random random(14);
  std::string text = "seconds,b,y\n";
  std::vector<Row> data(300);
  for (Row& row : data) {
    row.numbers["seconds"] = 1.7e9 + std::floor(random.uniform(0.0, 1e6));
    row.numbers["b"] = random.uniform(-1.0, 1.0);
    row.numbers["y"] = 20.0 + 3e-6 * (row.numbers["seconds"] - 1.7e9) + row.numbers["b"] + 0.1 * random.normal();
    text += fmt::format("{},{},{}\n", row.numbers["seconds"], row.numbers["b"], row.numbers["y"]);
  }
  folder.write("d.csv", text);
  ASSERT_EQ(folder.run(llmt_program + " fit d.csv -t y -o m.json --validity crisp --max-leaves 2").exit_code, 0);
  ASSERT_EQ(folder.run(llmt_program + " predict m.json d.csv -o p.csv").exit_code, 0);
  const Outcome printed = folder.run(llmt_program + " inspect m.json --rules");
  ASSERT_EQ(printed.exit_code, 0) << printed.err;
  EXPECT_NE(printed.out.find("(seconds - 1.70"), std::string::npos) << printed.out;
  const PrintedRules rules(printed.out.substr(0, printed.out.find("\ninput ")));
  const Eigen::VectorXd y = llmt::Csv::read(folder.file("p.csv")).numbers("y_pred");
  // Five digits of every number: 1e-4 of what the terms move.
  for (std::size_t i = 0; i < data.size(); ++i) EXPECT_NEAR(rules(data[i]), y(static_cast<int>(i)), 5e-3);
}

TEST(ReadableSteps, LongSetsOfCategoriesAreNamedOnce) {
  const Folder folder;
  llmt::Random random(16);
  std::string text = "town,a,y\n";
  for (int i = 0; i < 600; ++i) {
    const int town = i % 16;
    const double a = random.uniform(0.0, 10.0);
    const double y = town % 2 == 0 ? (a > 5.0 ? 30.0 - a : a) : (a > 3.0 ? -20.0 + a : 3.0 * a);
    text += fmt::format("town_number_{},{},{}\n", town, a, y + 0.1 * random.normal());
  }
  folder.write("d.csv", text);
  ASSERT_EQ(folder.run(llmt_program + " fit d.csv -t y -o m.json --readable=5").exit_code, 0);
  const Outcome printed = folder.run(llmt_program + " inspect m.readable.json --rules");
  const std::string& out = printed.out;
  ASSERT_NE(out.find("set 1 = {town_number_"), std::string::npos) << out;
  EXPECT_NE(out.find("town in set 1"), std::string::npos) << out;
  const std::string set = out.substr(out.find("= {") + 2, out.find("}", out.find("= {")) - out.find("= {") - 1);
  EXPECT_EQ(out.find(set, out.find(set) + 1), std::string::npos) << set;
}

TEST(ReadableSteps, IsExportedAsIfAndEquations) {
  const Folder folder;
  const std::vector<Row> data = rows();
  folder.write("d.csv", text_of(data));
  ASSERT_EQ(folder.run(llmt_program + " fit d.csv -t y -o m.json --readable=2").exit_code, 0);
  ASSERT_EQ(folder.run(llmt_program + " predict m.readable.json d.csv -o p.csv").exit_code, 0);
  const Outcome python = folder.run(llmt_program + " export m.readable.json --plain python --name heat -o heat.py");
  ASSERT_EQ(python.exit_code, 0) << python.err;
  const std::string source = llmt::read_file(folder.file("heat.py"));
  EXPECT_NE(source.find("def heat_y(a, b, colour):"), std::string::npos) << source;
  EXPECT_NE(source.find("    if "), std::string::npos) << source;
  EXPECT_NE(folder.run(llmt_program + " export m.json --plain sql -o no.sql").err.find("more than its rules"),
            std::string::npos);
  EXPECT_EQ(folder.run(llmt_program + " export m.readable.json --plain cobol -o no.cob").exit_code, 2);
  EXPECT_EQ(folder.run(llmt_program + " export m.readable.json -o no.c").exit_code, 2);
}

}  // namespace
