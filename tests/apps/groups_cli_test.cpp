// Rows that belong together: --groups, repeats, and rows that follow each other.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/programs.hpp"
#include "llmt/random.hpp"

namespace {

using nlohmann::json;
using program::Folder;
using program::llmt_program;
using program::Outcome;

// Rows of 20 machines: y = a + what the machine adds, which its column b tells only within the table.
std::string rows_of_machines(double added) {
  llmt::Random random(11);
  std::string text = "a,b,machine,y\n";
  for (int machine = 0; machine < 20; ++machine) {
    const double of_machine = random.normal();
    const double b = random.uniform(-1.0, 1.0);
    for (int k = 0; k < 15; ++k) {
      const double a = random.uniform(-1.0, 1.0);
      text += fmt::format("{},{},m{},{}\n", a, b + 0.01 * random.normal(), machine,
                          a + added * of_machine + 0.05 * random.normal());
    }
  }
  return text;
}

double held_out_rmse(const Folder& folder, const std::string& arguments) {
  const Outcome outcome = folder.run(llmt_program + " fit d.csv -t y --json " + arguments);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  const json fit = json::parse(outcome.out);
  return fit.contains("sums") ? fit["sums"][0]["held_out_rmse"].get<double>()
                              : fit["partitions"][0]["chosen"]["cv_rmse"].get<double>();
}

TEST(Groups, AreHeldOutAsAWholeAndAreNoInput) {
  const Folder folder;
  folder.write("d.csv", rows_of_machines(1.0));
  // A new machine adds 1 in the mean of squares, which nothing tells; a new row of a known machine has noise alone.
  EXPECT_LT(held_out_rmse(folder, "--ignore machine"), 0.3);
  EXPECT_GT(held_out_rmse(folder, "--groups machine"), 0.7);
  EXPECT_LT(held_out_rmse(folder, "--ignore machine --boost"), 0.4);
  EXPECT_GT(held_out_rmse(folder, "--groups machine --boost"), 0.7);
  const Outcome outcome = folder.run(llmt_program + " fit d.csv -t y --groups machine -o m.json");
  EXPECT_NE(outcome.out.find("2 inputs: a, b"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("that keeps groups together"), std::string::npos) << outcome.out;
  const Outcome compared = folder.run(llmt_program + " compare d.csv -t y --groups machine --json");
  ASSERT_EQ(compared.exit_code, 0) << compared.err;
  for (const json& method : json::parse(compared.out)["methods"]) EXPECT_GT(method["cv_rmse"], 0.7);
}

TEST(Groups, ThatAreNoColumnOrLackACellAreRefusedByName) {
  const Folder folder;
  folder.write("d.csv", rows_of_machines(1.0) + "0.5,0.5,,1\n");
  const auto refusal = [&](const std::string& arguments) {
    const Outcome outcome = folder.run(llmt_program + " fit d.csv -t y " + arguments);
    EXPECT_NE(outcome.exit_code, 0);
    EXPECT_EQ(outcome.out, "");
    return outcome.err;
  };
  EXPECT_EQ(refusal("--groups machine"),
            "llmt: d.csv: line 302: column \"machine\" says the groups of --groups and is empty\n");
  EXPECT_NE(refusal("--groups engine").find("there is no column \"engine\""), std::string::npos);
  EXPECT_EQ(refusal("--groups y"), "llmt: column \"y\" is a target and says the groups\n");
  EXPECT_NE(
      refusal("--groups machine --inputs a,machine").find("\"machine\", which is a target, the weight, the groups"),
      std::string::npos);
  EXPECT_NE(refusal("--groups machine --ignore b --stream").find("--groups"), std::string::npos);
}

TEST(Groups, OfRepeatsAreSaidWithWhatRepeatsDifferBy) {
  const Folder folder;
  llmt::Random random(5);
  std::string text = "a,b,y\n";
  for (int k = 0; k < 60; ++k) {
    const double a = random.uniform(-1.0, 1.0), b = random.uniform(-1.0, 1.0), own = random.normal();
    for (int i = 0; i < 4; ++i) {
      text += fmt::format("{},{},{}\n", a + 1e-12 * random.normal(), b, a + own + 0.1 * random.normal());
    }
  }
  folder.write("d.csv", text);
  const Outcome outcome = folder.run(llmt_program + " fit d.csv -t y");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("taken for repeats of one setting"), std::string::npos) << outcome.out;
  const json fit = json::parse(folder.run(llmt_program + " fit d.csv -t y --json").out);
  const json& errors = fit["partitions"][0]["equal_rows"];
  EXPECT_NEAR(errors["cv_rmse_known"][0].get<double>(), 0.1, 0.015);
  EXPECT_GT(errors["cv_rmse_new"][0].get<double>(), 0.7);
  EXPECT_EQ(errors["rows_known"], 0);
}

TEST(Groups, OfWhichThereIsOneLeaveNothingToHoldOut) {
  const Folder folder;
  std::string text = "a,g,y\n";
  for (int i = 0; i < 60; ++i) text += fmt::format("{},{},{}\n", i % 7, 1, i % 7 + i % 3);
  folder.write("d.csv", text);
  const Outcome outcome = folder.run(llmt_program + " fit d.csv -t y --groups g");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("no held-out rows, because all rows are of one group"), std::string::npos) << outcome.out;
  const Outcome without = folder.run(llmt_program + " fit d.csv -t y --cv 0");
  EXPECT_EQ(without.out.find("of one group"), std::string::npos) << without.out;
  const Outcome sum = folder.run(llmt_program + " fit d.csv -t y --groups g --boost");
  EXPECT_NE(sum.exit_code, 0);
  EXPECT_NE(sum.err.find("groups of rows: 1; at least 5 are needed"), std::string::npos) << sum.err;
}

// What nobody measured drifts slowly, and an input of time follows it.
std::string drifting(bool in_order) {
  llmt::Random random(3);
  std::vector<std::string> rows;
  double drift = 0.0;
  for (int t = 0; t < 300; ++t) {
    drift += 0.3 * random.normal();
    const double a = random.uniform(-1.0, 1.0);
    rows.push_back(fmt::format("{},{},{}\n", a, t, a + drift + 0.05 * random.normal()));
  }
  const std::vector<Eigen::Index> shuffled = random.permutation(300);
  std::string text = "a,t,y\n";
  for (std::size_t k = 0; k < rows.size(); ++k) text += rows[in_order ? k : static_cast<std::size_t>(shuffled[k])];
  return text;
}

TEST(Neighbours, ThatAreAlikeAreSaidWithWhatBlocksSay) {
  const Folder folder;
  folder.write("d.csv", drifting(true));
  const Outcome outcome = folder.run(llmt_program + " fit d.csv -t y");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("Rows that follow each other are alike"), std::string::npos) << outcome.out;
  const std::string of_blocks = fmt::format("{:.4g}", held_out_rmse(folder, "--contiguous"));
  EXPECT_NE(outcome.out.find(of_blocks), std::string::npos) << of_blocks << "\n" << outcome.out;
  folder.write("d.csv", drifting(false));
  const Outcome shuffled = folder.run(llmt_program + " fit d.csv -t y");
  EXPECT_EQ(shuffled.out.find("Rows that follow each other"), std::string::npos) << shuffled.out;
}

}  // namespace
