// Numbers that are codes, from a table to a prediction.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/programs.hpp"
#include "llmt/csv.hpp"
#include "llmt/random.hpp"

namespace {

using nlohmann::json;
using program::Folder;
using program::llmt_program;
using program::Outcome;

constexpr double of_side[] = {0.0, 2.0, -1.5, 1.0, -2.0, 1.5, -0.5, 0.8};

// 240 rows. `side` is 1 ... 8, also written 1.0 or 1e0; its effect has no order.
std::string coded_table() {
  const char* endings[] = {"", ".0", "e0"};
  llmt::Random random(1);
  std::string text = "side,a,b,y\n";
  for (int i = 0; i < 240; ++i) {
    const double a = random.uniform(-1.0, 1.0);
    const double b = random.uniform(-1.0, 1.0);
    const double y = of_side[i % 8] + 2.0 * std::sin(2.0 * a) + b * b + 0.2 * random.normal();
    text += fmt::format("{}{},{},{},{}\n", i % 8 + 1, endings[i / 8 % 3], a, b, y);
  }
  return text;
}

TEST(Codes, AreFoundToldAndPredictedByNumber) {
  const Folder folder;
  folder.write("t.csv", coded_table());
  const Outcome fitted = folder.run(llmt_program + " fit t.csv -t y -o m.json --json");
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  const json codes = json::parse(fitted.out)["codes"];
  EXPECT_EQ(codes["taken"], json({"side"}));
  EXPECT_LT(codes["cv_rmse_as_codes"], codes["cv_rmse_as_numbers"]);
  EXPECT_NE(folder.run(llmt_program + " fit t.csv -t y").out.find("taken for codes, that is for categories: side;"),
            std::string::npos);
  EXPECT_FALSE(json::parse(folder.run(llmt_program + " fit t.csv -t y --no-codes --json").out).contains("codes"));

  folder.write("q.csv", "side,a,b\n3,0.5,0\n3.0,0.5,0\n3e0,0.5,0\n3.4,0.5,0\n19,0.5,0\n8,0.5,0\n,0.5,0\n");
  const Outcome predicted = folder.run(llmt_program + " predict m.json q.csv --json --interval 0.9");
  ASSERT_EQ(predicted.exit_code, 0) << predicted.err;
  const json answer = json::parse(predicted.out);
  EXPECT_EQ(answer["unseen_codes"], 2);
  EXPECT_EQ(answer["unknown_categories"], 0);
  EXPECT_EQ(answer["missing_values"], 1);
  const std::vector<double> y = answer["targets"][0]["predicted"];
  for (const int same : {1, 2, 3}) EXPECT_EQ(y[same], y[0]);
  EXPECT_EQ(y[4], y[5]);
  const std::string text = folder.run(llmt_program + " predict m.json q.csv").err;
  EXPECT_NE(text.find("2 codes that were not in training, taken as the nearest"), std::string::npos) << text;

  // Each side has 30 rows with a noise of 0.2: its mean is known to 0.037.
  std::string sides = "side,a,b\n";
  for (int side = 1; side <= 8; ++side) sides += fmt::format("{},0.5,0\n{},-0.3,0.5\n", side, side);
  folder.write("sides.csv", sides);
  const Outcome of_sides = folder.run(llmt_program + " predict m.json sides.csv");
  const Eigen::VectorXd found = llmt::Csv::parse(of_sides.out, "sides").numbers("y_pred");
  ASSERT_EQ(found.size(), 16) << of_sides.err;
  for (int k = 0; k < 8; ++k) {
    EXPECT_NEAR(found(2 * k), of_side[k] + 2.0 * std::sin(1.0), 0.12) << k;
    EXPECT_NEAR(found(2 * k + 1), of_side[k] - 2.0 * std::sin(0.6) + 0.25, 0.12) << k;
  }
}

TEST(Codes, AreExplainedAndInspected) {
  const Folder folder;
  folder.write("t.csv", coded_table());
  ASSERT_EQ(folder.run(llmt_program + " fit t.csv -t y -o m.json --readable --json").exit_code, 0);
  const Outcome explained = folder.run(llmt_program + " explain m.json t.csv --row 2 --json");
  ASSERT_EQ(explained.exit_code, 0) << explained.err;
  bool found = false;
  const json said = json::parse(explained.out);
  for (const json& entry : said["targets"][0]["contributions"]) {
    if (entry["input"] != "side") continue;
    EXPECT_EQ(entry["value"], 2.0);
    found = true;
  }
  EXPECT_TRUE(found);
  for (const char* model : {"m.json", "m.readable.json"}) {
    const Outcome inspected = folder.run(llmt_program + " inspect " + model);
    ASSERT_EQ(inspected.exit_code, 0) << inspected.err;
    EXPECT_NE(inspected.out.find("8 categories: 1, 2, 3, 4, 5, 6, 7, 8"), std::string::npos) << inspected.out;
    EXPECT_EQ(folder.run(llmt_program + " predict " + model + " t.csv -o p.csv").exit_code, 0);
  }
  EXPECT_EQ(folder.run(llmt_program + " inspect --rules m.readable.json").exit_code, 0);
}

}  // namespace
