// What training has not shown, and what says that nothing is there, from a table to a prediction.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "apps/programs.hpp"
#include "llmt/csv.hpp"
#include "llmt/random.hpp"

namespace {

using nlohmann::json;
using program::Folder;
using program::llmt_program;
using program::Outcome;

// y = 0 in DE, 1 in FR, 5 in NA, a fourth of the rows, + 2 x. `empty`: what a cell of NA says.
std::string countries(const std::string& empty) {
  llmt::Random random(4);
  std::string text = "country,x,y\n";
  for (int i = 0; i < 240; ++i) {
    const int kind = i % 4 == 3 ? 2 : i % 2;
    const double x = random.uniform();
    text += fmt::format("{},{},{}\n",
                        kind == 0   ? "DE"
                        : kind == 1 ? "FR"
                                    : empty,
                        x, (kind == 2 ? 5.0 : kind) + 2.0 * x + 0.05 * random.normal());
  }
  return text;
}

std::vector<double> predictions(const Folder& folder, const std::string& table) {
  folder.write("q.csv", table);
  const Outcome predicted = folder.run(llmt_program + " predict m.json q.csv --json");
  EXPECT_EQ(predicted.exit_code, 0) << predicted.err;
  return json::parse(predicted.out)["targets"][0]["predicted"];
}

TEST(UnseenProgram, EmptyCellsOfWordsAreLearned) {
  const Folder folder;
  folder.write("t.csv", countries(""));
  for (const char* options : {"", " --validity crisp", " --boost"}) {
    const Outcome fitted = folder.run(llmt_program + " fit t.csv -t y -o m.json" + options);
    ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
    EXPECT_EQ(fitted.err.find("taken as missing"), std::string::npos) << fitted.err;
    const std::vector<double> y = predictions(folder, "country,x\nDE,0.5\nFR,0.5\n,0.5\nNA,0.5\n");
    EXPECT_NEAR(y[0], 1.0, 0.1) << options;
    EXPECT_NEAR(y[1], 2.0, 0.1) << options;
    EXPECT_NEAR(y[2], 6.0, 0.1) << options;
    EXPECT_EQ(y[3], y[2]) << options;
    const std::string inspected = folder.run(llmt_program + " inspect m.json").out;
    EXPECT_NE(inspected.find("(empty)"), std::string::npos) << inspected;
  }
  const Outcome shown = folder.run(llmt_program + " fit t.csv -t y --validity crisp");
  EXPECT_NE(shown.out.find("Missing values in the inputs: 60 (country 60)"), std::string::npos) << shown.out;
}

TEST(UnseenProgram, SaysWhichWordsAreTakenAsMissing) {
  const Folder folder;
  folder.write("t.csv", countries("NA"));
  const Outcome fitted = folder.run(llmt_program + " fit t.csv -t y -o m.json");
  EXPECT_NE(
      fitted.err.find("60 cells NA of country are taken as missing; other columns have none; --categorical country "
                      "takes NA for a word"),
      std::string::npos)
      << fitted.err;
  EXPECT_NEAR(predictions(folder, "country,x\nNA,0.5\n")[0], 6.0, 0.1);
}

TEST(UnseenProgram, TakesAMarkForAWordWhereTheColumnIsNamed) {
  const Folder folder;
  folder.write("t.csv", countries("NA") + ",0.5,-4\n,0.4,-4\n,0.3,-4\n,0.2,-4\n,0.6,-4\n,0.7,-4\n");
  for (const char* options : {"", " --boost"}) {
    const Outcome fitted = folder.run(llmt_program + " fit t.csv -t y --categorical country -o m.json" + options);
    ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
    EXPECT_EQ(fitted.err, "") << options;
    const json levels = json::parse(llmt::read_file(folder.file("m.json")))["inputs"][0]["levels"];
    EXPECT_EQ(levels, json({"DE", "FR", "NA", ""}));
    const std::vector<double> y = predictions(folder, "country,x\nNA,0.5\nDE,0.5\n,0.5\nnull,0.5\n");
    EXPECT_NEAR(y[0], 6.0, 0.2) << options;
    EXPECT_NEAR(y[1], 1.0, 0.2) << options;
    EXPECT_NEAR(y[2], -4.0, 0.8) << options;
    EXPECT_EQ(y[3], y[2]) << options;  // no word of the model: it says that nothing is there
  }
}

TEST(UnseenProgram, SaysWhichIntervalsAreTooNarrow) {
  const Folder folder;
  folder.write("t.csv", countries("SE"));
  folder.write("q.csv", "country,x\nDE,0.5\nNO,0.5\n,0.5\nSE,\n");
  for (const char* options : {"", " --boost"}) {
    ASSERT_EQ(folder.run(llmt_program + " fit t.csv -t y -o m.json" + options).exit_code, 0);
    const Outcome said = folder.run(llmt_program + " predict m.json q.csv --interval 0.9 -o p.csv");
    EXPECT_NE(
        said.err.find("3 intervals are likely too narrow, because the rows have an empty cell or an unknown category"),
        std::string::npos)
        << options << said.err;
    const json answer = json::parse(folder.run(llmt_program + " predict m.json q.csv --interval 0.9 --json").out);
    EXPECT_EQ(answer["uncalibrated_intervals"], 3) << options;
    EXPECT_EQ(answer["unknown_categories"], 1) << options;
    EXPECT_EQ(answer["missing_values"], 2) << options;
    EXPECT_EQ(answer["outside_rows"], 0) << options;
    const std::vector<double> y = answer["targets"][0]["predicted"];
    EXPECT_NEAR(y[1], 2.65, 0.4) << options;  // the mean of the countries, 1.625, and 2 x
    EXPECT_NEAR(y[2], 2.65, 0.4) << options;
    EXPECT_NEAR(y[3], 6.0, 0.4) << options;
  }
}

// Of 51 shops one has no feature of its own in older versions, and none was fitted.
TEST(UnseenProgram, SumsTakeManyLevels) {
  const Folder folder;
  llmt::Random random(8);
  std::string text = "shop,x,y\n";
  for (int i = 0; i < 61 * 4; ++i) {
    const double x = random.uniform();
    text += fmt::format("s{},{},{}\n", i % 61, x, i % 61 % 7 + x + 0.05 * random.normal());
  }
  folder.write("t.csv", text);
  const Outcome fitted = folder.run(llmt_program + " fit t.csv -t y --boost --json");
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  EXPECT_LT(json::parse(fitted.out)["sums"][0]["held_out_rmse"], 0.3);
  std::string many = "shop,x,y\n";
  for (int i = 0; i < 260 * 2; ++i) many += fmt::format("s{},{},{}\n", i % 260, i % 11, i % 260 < 130 ? 0 : 1);
  folder.write("t.csv", many);
  const std::string said = folder.run(llmt_program + " fit t.csv -t y --boost").out;
  EXPECT_NE(said.find("shop: the 5 rarest of 260 categories are not told from each other"), std::string::npos) << said;
}

}  // namespace
