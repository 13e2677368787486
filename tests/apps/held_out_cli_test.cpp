#include <fmt/format.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "apps/programs.hpp"
#include "llmt/csv.hpp"
#include "llmt/fit.hpp"
#include "llmt/random.hpp"

namespace {

using nlohmann::json;
using program::Folder;
using program::llmt_program;
using program::Outcome;

// `rows` rows: y = |a| + b / 2 + normal noise of 0.05.
std::string kinked(int rows, int seed) {
  llmt::Random random(seed);
  std::string text = "a,b,y\n";
  for (int i = 0; i < rows; ++i) {
    const double a = random.uniform(-1.0, 1.0);
    const double b = random.uniform(-1.0, 1.0);
    text += fmt::format("{},{},{}\n", a, b, std::abs(a) + 0.5 * b + 0.05 * random.normal());
  }
  return text;
}

TEST(LlmtProgram, IntervalsHoldTheirLevelOnFreshRows) {
  const Folder folder;
  folder.write("d.csv", kinked(200, 1));
  folder.write("fresh.csv", kinked(1000, 2));
  ASSERT_EQ(folder.run(llmt_program + " fit d.csv -t y --cv 3 -o m.json").exit_code, 0);
  const Outcome predicted = folder.run(llmt_program + " predict m.json fresh.csv --interval 0.9 -o p.csv");
  ASSERT_EQ(predicted.exit_code, 0) << predicted.err;
  const llmt::Csv result = llmt::Csv::read(folder.file("p.csv"));
  EXPECT_EQ(result.columns(), (std::vector<std::string>{"a", "b", "y", "y_pred", "y_low", "y_high", "outside",
                                                        "outside_by", "in_gap", "leverage"}));
  const Eigen::ArrayXd y = result.numbers("y");
  const Eigen::ArrayXd low = result.numbers("y_low");
  const Eigen::ArrayXd high = result.numbers("y_high");
  const double inside = static_cast<double>((low <= y && y <= high).count()) / 1000.0;
  EXPECT_GT(inside, 0.85);
  EXPECT_LT(inside, 0.97);
  EXPECT_LT((high - low).mean(), 0.25);  // 3.3 standard deviations of the noise are 0.16

  const json values = json::parse(folder.run(llmt_program + " predict m.json fresh.csv --interval 0.9 --json").out);
  EXPECT_EQ(values["targets"][0]["low"][0], low(0));
  EXPECT_EQ(values["targets"][0]["high"][0], high(0));
  const Outcome narrow = folder.run(llmt_program + " predict m.json fresh.csv --interval 0.999");
  EXPECT_NE(narrow.exit_code, 0);
  EXPECT_NE(narrow.err.find("level 0.999 needs at least 999 held-out rows, there are 200"), std::string::npos);
}

// Of a tree and of a sum: the ends of 90 % are the quantiles of 5 and 95 %, and no quantile is below another.
TEST(LlmtProgram, QuantilesDoNotCross) {
  const Folder folder;
  folder.write("d.csv", kinked(300, 1));
  folder.write("fresh.csv", kinked(1000, 2));
  for (const char* kind : {"", " --boost"}) {
    ASSERT_EQ(folder.run(llmt_program + " fit d.csv -t y -o m.json" + kind).exit_code, 0);
    const Outcome predicted =
        folder.run(llmt_program +
                   " predict m.json fresh.csv --interval 0.9 --quantiles 0.05,0.25,0.45,0.5,0.55,0.75,0.95 -o p.csv");
    ASSERT_EQ(predicted.exit_code, 0) << predicted.err;
    const llmt::Csv result = llmt::Csv::read(folder.file("p.csv"));
    EXPECT_EQ(result.numbers("y_q0.05"), result.numbers("y_low"));
    EXPECT_EQ(result.numbers("y_q0.95"), result.numbers("y_high"));
    const Eigen::ArrayXd y = result.numbers("y");
    Eigen::ArrayXd before = Eigen::ArrayXd::Constant(1000, -1e9);
    for (const double p : {0.05, 0.25, 0.45, 0.5, 0.55, 0.75, 0.95}) {
      const Eigen::ArrayXd values = result.numbers(fmt::format("y_q{}", p));
      EXPECT_TRUE((values >= before).all()) << kind << p;
      EXPECT_NEAR(static_cast<double>((y <= values).count()) / 1000.0, p, 0.08) << kind;
      before = values;
    }
  }
  const Outcome falling = folder.run(llmt_program + " predict m.json fresh.csv --quantiles 0.5,0.1");
  EXPECT_EQ(falling.exit_code, 2);
  EXPECT_NE(falling.err.find("the probability 0.1 must lie between 0 and 1, and above those before it"),
            std::string::npos)
      << falling.err;
  const json values =
      json::parse(folder.run(llmt_program + " predict m.json fresh.csv --quantiles 0.1,0.5 --json").out);
  EXPECT_EQ(values["targets"][0]["quantiles"][0]["probability"], 0.1);
  EXPECT_EQ(values["targets"][0]["quantiles"][1]["values"], values["targets"][0]["predicted"]);
}

// y = x + noise of the variance 1 / w.
std::string with_weights(int rows, std::uint64_t seed) {
  llmt::Random random(seed);
  std::string text = "x,w,y\n";
  for (int i = 0; i < rows; ++i) {
    const double x = random.uniform();
    const double weight = i % 2 == 0 ? 0.2 : 5.5;
    text += fmt::format("{},{},{}\n", x, weight, x + random.normal() / std::sqrt(weight));
  }
  return text;
}

TEST(LlmtProgram, IntervalsFollowTheWeightsOfNewRows) {
  const Folder folder;
  folder.write("d.csv", with_weights(600, 1));
  folder.write("fresh.csv", with_weights(2000, 2));
  folder.write("bad.csv", "x,w\n0.5,1\n0.5,0\n");
  for (const char* kind : {"", " --boost"}) {
    ASSERT_EQ(folder.run(llmt_program + " fit d.csv -t y --weight w -o m.json" + kind).exit_code, 0);
    const Outcome predicted =
        folder.run(llmt_program + " predict m.json fresh.csv --weight w --interval 0.9 --quantiles 0.05 -o p.csv");
    ASSERT_EQ(predicted.exit_code, 0) << predicted.err;
    const llmt::Csv result = llmt::Csv::read(folder.file("p.csv"));
    EXPECT_EQ(result.numbers("y_q0.05"), result.numbers("y_low"));
    const Eigen::ArrayXd widths = result.numbers("y_high") - result.numbers("y_low");
    EXPECT_NEAR(widths(0), 3.29 / std::sqrt(0.2), 1.2) << kind;
    EXPECT_NEAR(widths(1), 3.29 / std::sqrt(5.5), 0.4) << kind;
    const Outcome bad = folder.run(llmt_program + " predict m.json bad.csv --weight w --interval 0.9");
    EXPECT_EQ(bad.exit_code, 1);
    EXPECT_NE(bad.err.find("bad.csv:3: column \"w\": a weight is positive, this one is 0"), std::string::npos)
        << bad.err;
  }
  const Outcome alone = folder.run(llmt_program + " predict m.json fresh.csv --weight w");
  EXPECT_EQ(alone.exit_code, 2);
  EXPECT_NE(alone.err.find("give --interval or --quantiles too"), std::string::npos) << alone.err;
}

TEST(LlmtProgram, NoIntervalsWithoutHeldOutResiduals) {
  const Folder folder;
  folder.write("d.csv", kinked(100, 1));
  for (const char* without : {"--cv 3 --no-intervals", "--cv 0"}) {
    ASSERT_EQ(folder.run(fmt::format("{} fit d.csv -t y {} -o m.json", llmt_program, without)).exit_code, 0);
    const Outcome predicted = folder.run(llmt_program + " predict m.json d.csv --interval 0.9");
    EXPECT_EQ(predicted.exit_code, 1) << without;
    EXPECT_EQ(predicted.out, "");
    EXPECT_NE(predicted.err.find("m.json: the file has no held-out residuals"), std::string::npos) << predicted.err;
    EXPECT_NE(predicted.err.find("fit without --no-intervals and with folds"), std::string::npos);
  }
}

TEST(LlmtProgram, IntervalsOfRowsWithEmptyCellsAreWiderOrSaidToBeTooNarrow) {
  const Folder folder;
  const std::string whole = kinked(200, 1);
  const std::size_t header = whole.find('\n') + 1;
  const std::size_t row = whole.find('\n', header) + 1;
  // One row without its first cell, and the row as it is.
  const std::string first = whole.substr(header, row - header);
  folder.write("new.csv", whole.substr(0, header) + first.substr(first.find(',')) + first);
  folder.write("d.csv", whole);
  ASSERT_EQ(folder.run(llmt_program + " fit d.csv -t y -o m.json").exit_code, 0);
  const Outcome few = folder.run(llmt_program + " predict m.json new.csv --interval 0.9 --json");
  ASSERT_EQ(few.exit_code, 0) << few.err;
  EXPECT_EQ(json::parse(few.out)["uncalibrated_intervals"], 1);
  EXPECT_NE(
      folder.run(llmt_program + " predict m.json new.csv --interval 0.9")
          .err.find("; 1 interval is likely too narrow, because the row has an empty cell or an unknown category"),
      std::string::npos);
  std::string gaps = whole.substr(0, header);
  int count = 0;
  for (std::size_t at = header; at < whole.size(); ++count) {
    const std::size_t end = whole.find('\n', at) + 1;
    gaps +=
        whole.substr(count % 10 == 3 ? whole.find(',', at) : at, end - (count % 10 == 3 ? whole.find(',', at) : at));
    at = end;
  }
  folder.write("d.csv", gaps);
  ASSERT_EQ(folder.run(llmt_program + " fit d.csv -t y -o m.json").exit_code, 0);
  const json many = json::parse(folder.run(llmt_program + " predict m.json new.csv --interval 0.9 --json").out);
  EXPECT_FALSE(many.contains("uncalibrated_intervals"));
  const json& target = many["targets"][0];
  const auto width = [&](int i) { return target["high"][i].get<double>() - target["low"][i].get<double>(); };
  EXPECT_GT(width(0), 2.0 * width(1));
}

TEST(LlmtProgram, CompareListsTheMethodsAndRecommendsOne) {
  const Folder folder;
  folder.write("d.csv", kinked(200, 1));
  const Outcome compared = folder.run(llmt_program + " compare d.csv -t y --cv 3 --json");
  ASSERT_EQ(compared.exit_code, 0) << compared.err;
  const json result = json::parse(compared.out);
  EXPECT_EQ(result["rows"], 200);
  EXPECT_EQ(result["folds"], 3);
  std::vector<std::string> names;
  std::map<std::string, double> errors;
  for (const json& method : result["methods"]) {
    names.push_back(method["method"]);
    errors[names.back()] = method["cv_rmse"];
    EXPECT_EQ(method["fold_rmse"].size(), 3U) << names.back();
    if (method["method"] == "least squares" || method["method"] == "M5', smoothed") {
      EXPECT_TRUE(method["crps"].is_null() && method["coverage_90"].is_null()) << names.back();
    } else {
      EXPECT_NEAR(method["coverage_90"].get<double>(), 0.9, 0.1) << names.back();
      EXPECT_GT(method["crps"].get<double>(), 0.3 * errors[names.back()]) << names.back();  // 0.56 of normal errors
      EXPECT_LT(method["crps"].get<double>(), errors[names.back()]) << names.back();
    }
    if (names.back() == "sum of trees") continue;  // its leaves have a constant and slopes of their path; jumps add up
    EXPECT_GE(method["parameters"], 3 * method["leaves"].get<int>()) << names.back();
    EXPECT_GE(method["largest_jump"], 0.0) << names.back();
  }
  EXPECT_EQ(names,
            (std::vector<std::string>{"least squares", "crisp tree, RD", "crisp tree, RETIS", "crisp tree, RA",
                                      "M5', smoothed", "Gaussians, as grown", "Gaussians, re-estimated", "blend, joint",
                                      "LOLIMOT", "HILOMOT", "crisp tree, quadratic leaves", "sum of trees"}));
  ASSERT_TRUE(errors.contains(result["recommended"])) << result["recommended"];
  EXPECT_LT(errors[result["recommended"]], 0.5 * errors["least squares"]);
  const std::string why = result["recommendation"];
  EXPECT_TRUE(why.starts_with("Take " + result["recommended"].get<std::string>() + ":")) << why;

  const Outcome text = folder.run(llmt_program + " compare d.csv -t y --cv 3");
  ASSERT_EQ(text.exit_code, 0);
  EXPECT_NE(text.out.find(why), std::string::npos);
}

}  // namespace
