// llmt fit --readable and llmt inspect --rules as a user runs them.
#include <fmt/format.h>

#include <Eigen/QR>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "apps/printed_rules.hpp"
#include "apps/programs.hpp"
#include "llmt/csv.hpp"
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

TEST(ReadableProgram, WhatIsPrintedIsWhatIsPredicted) {
  const Folder folder;
  const std::vector<Row> data = rows();
  folder.write("d.csv", text_of(data));
  for (const char* terms : {"linear", "quadratic"}) {
    const Outcome fitted = folder.run(fmt::format(
        "{} fit d.csv -t y -o m.json --validity crisp --local-models {} --readable=2 --json", llmt_program, terms));
    ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
    const json readable = json::parse(fitted.out)["readable"][0];
    const Outcome printed = folder.run(llmt_program + " inspect m.readable.json --rules");
    ASSERT_EQ(printed.exit_code, 0) << printed.err;
    const PrintedRules rules(printed.out);
    EXPECT_EQ(rules.count(), readable["leaves"]);
    EXPECT_GT(rules.count(), 1u);
    EXPECT_NE(printed.out.find(fmt::format("size {} ", readable["size"].get<int>())), std::string::npos);
    ASSERT_EQ(folder.run(llmt_program + " predict m.readable.json d.csv -o p.csv").exit_code, 0);
    const llmt::Csv predicted = llmt::Csv::read(folder.file("p.csv"));
    const Eigen::VectorXd y = predicted.numbers("y_pred");
    for (std::size_t i = 0; i < data.size(); ++i) EXPECT_NEAR(rules(data[i]), y(i), 1e-9 * (1.0 + std::abs(y(i))));
  }
}

// The numbers in the line of `text` that begins so.
std::vector<double> figures_behind(const std::string& begin, const std::string& text) {
  const std::size_t at = text.find("\n" + begin);
  if (at == std::string::npos) return {};
  std::istringstream line(text.substr(at + 1 + begin.size(), text.find('\n', at + 1) - at - 1 - begin.size()));
  std::vector<double> figures;
  for (double figure = 0.0; line >> figure;) figures.push_back(figure);
  return figures;
}

Eigen::MatrixXd regressors_of(const std::vector<Row>& rows) {
  Eigen::MatrixXd result(rows.size(), 6);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::string& colour = rows[i].words.at("colour");
    result.row(static_cast<int>(i)) << 1.0, rows[i].numbers.at("a"), rows[i].numbers.at("b"), rows[i].numbers.at("e"),
        colour == "red", colour == "green";
  }
  return result;
}

Eigen::VectorXd outputs_of(const std::vector<Row>& rows) {
  Eigen::VectorXd result(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) result(static_cast<int>(i)) = rows[i].numbers.at("y");
  return result;
}

TEST(ReadableProgram, TheFileIsAnOrdinaryModelAndTheSummarySaysWhatEachCosts) {
  const Folder folder;
  folder.write("d.csv", text_of(rows()));
  const Outcome fitted = folder.run(llmt_program + " fit d.csv -t y -o m.json --readable --cv 3");
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  for (const char* text :
       {"readable", "least squares", "at most 15 % above", "m.readable.json", "Reading costs ", "-44 %"}) {
    EXPECT_NE(fitted.out.find(text), std::string::npos) << fitted.out;
  }
  // Held-out errors are those of rows that the fit has not seen, here by the printed rules and by least squares.
  const PrintedRules rules(folder.run(llmt_program + " inspect m.readable.json --rules").out);
  const std::vector<Row> learned = rows();
  const std::vector<Row> fresh = rows(22);
  const Eigen::VectorXd plane = regressors_of(learned).colPivHouseholderQr().solve(outputs_of(learned));
  Eigen::VectorXd of_rules(400);
  for (int i = 0; i < 400; ++i) of_rules(i) = rules(fresh[i]);
  const auto rmse = [&](const Eigen::VectorXd& predicted) {
    return std::sqrt((predicted - outputs_of(fresh)).squaredNorm() / 400.0);
  };
  const std::vector<double> readable = figures_behind("        readable ", fitted.out);
  const std::vector<double> linear = figures_behind("        least squares ", fitted.out);
  ASSERT_EQ(readable.size(), 5) << fitted.out;  // leaves, terms of a leaf, size, held-out RMSE and its spread
  EXPECT_EQ(readable[0], static_cast<double>(rules.count()));
  EXPECT_NEAR(readable[3] / rmse(of_rules), 1.0, 0.25);
  ASSERT_EQ(linear.size(), 5) << fitted.out;
  EXPECT_EQ(linear[0], 1.0);
  EXPECT_NEAR(linear[3] / rmse(regressors_of(fresh) * plane), 1.0, 0.05);
  EXPECT_EQ(folder.run(llmt_program + " predict m.readable.json d.csv --interval 0.9").exit_code, 0);
  EXPECT_EQ(folder.run(llmt_program + " explain m.readable.json d.csv").exit_code, 0);
  const Outcome leaves = folder.run(llmt_program + " inspect m.readable.json");
  EXPECT_NE(leaves.out.find("each holds in its box alone"), std::string::npos) << leaves.out;
  const Outcome without_file = folder.run(llmt_program + " fit d.csv -t y --readable=50 --validity crisp --cv 3");
  EXPECT_NE(without_file.out.find("at most 50 % above"), std::string::npos) << without_file.out;
  EXPECT_EQ(without_file.out.find("written to"), std::string::npos) << without_file.out;
  const Outcome three = folder.run(llmt_program + " fit d.csv -t y --readable-rules 3 --cv 3");
  EXPECT_NE(three.out.find("The readable tree has a smaller held-out error than the model chosen above."),
            std::string::npos)
      << three.out;
}

// A table on which blends are better than rules.
std::string waves(int rows, std::uint64_t seed) {
  llmt::Random random(seed);
  std::string text = "a,y\n";
  for (int i = 0; i < rows; ++i) {
    const double a = random.uniform(-3.0, 3.0);
    text += fmt::format("{},{}\n", a, 10.0 * std::sin(2.0 * a) + 0.2 * random.normal());
  }
  return text;
}

TEST(ReadableProgram, ThePriceIsSaidBesideTheChosenModel) {
  const Folder folder;
  folder.write("d.csv", waves(400, 8));
  const Outcome fitted = folder.run(llmt_program + " fit d.csv -t y --readable=200");
  const std::size_t begin = fitted.out.find("Reading costs ");
  ASSERT_NE(begin, std::string::npos) << fitted.out;
  double cost = 0.0, low = 0.0, high = 0.0, readable = 0.0, chosen = 0.0;
  constexpr const char* sentence =
      "Reading costs %lf %% more error (over the folds %lf to %lf %%): RMSE held-out %lf in the place of %lf.";
  ASSERT_EQ(std::sscanf(fitted.out.c_str() + begin, sentence, &cost, &low, &high, &readable, &chosen), 5);
  EXPECT_NEAR(cost, 100.0 * (readable / chosen - 1.0), 0.6);
  EXPECT_LE(low, cost);
  EXPECT_GE(high, cost);
  const json summary = json::parse(folder.run(llmt_program + " fit d.csv -t y --readable=200 --json").out);
  EXPECT_NEAR(summary["readable"][0]["cv_rmse"].get<double>(), readable, 5e-4 * readable);
  EXPECT_NEAR(summary["partitions"][0]["cv_rmse"].get<double>(), chosen, 5e-4 * chosen);
  EXPECT_GT(summary["partitions"][0]["importance"][0][0]["increase"].get<double>(), 5.0);
}

// The price on new rows lies in most tables between the prices of the folds that are printed with it, and on neither
// side of what is said in the mean.
TEST(ReadableProgram, ThePriceSaidIsThePricePaidOnNewRows) {
  const Folder folder;
  folder.write("fresh.csv", waves(2000, 50));
  const auto error_of = [&](const std::string& model) {
    const Outcome predicted = folder.run(fmt::format("{} predict {} fresh.csv -o p.csv", llmt_program, model));
    EXPECT_EQ(predicted.exit_code, 0) << predicted.err;
    const llmt::Csv table = llmt::Csv::read(folder.file("p.csv"));
    return (table.numbers("y_pred") - table.numbers("y")).norm();
  };
  int inside = 0;
  Eigen::VectorXd too_much(6);
  for (Eigen::Index k = 0; k < 6; ++k) {
    folder.write("d.csv", waves(400, 60 + static_cast<std::uint64_t>(k)));
    const Outcome fitted = folder.run(llmt_program + " fit d.csv -t y -o m.json --readable=200");
    const std::size_t begin = fitted.out.find("Reading costs ");
    ASSERT_NE(begin, std::string::npos) << fitted.out;
    double cost = 0.0, low = 0.0, high = 0.0;
    constexpr const char* sentence = "Reading costs %lf %% more error (over the folds %lf to %lf %%)";
    ASSERT_EQ(std::sscanf(fitted.out.c_str() + begin, sentence, &cost, &low, &high), 3) << fitted.out;
    const double paid = 100.0 * (error_of("m.readable.json") / error_of("m.json") - 1.0);
    inside += low <= paid && paid <= high ? 1 : 0;
    too_much(k) = cost - paid;
  }
  EXPECT_GE(inside, 4);
  const double mean = too_much.mean();
  const double error_of_mean = std::sqrt((too_much.array() - mean).square().sum() / (6.0 * 5.0));
  EXPECT_LT(std::abs(mean), 2.0 * error_of_mean) << too_much.transpose();
}

TEST(ReadableProgram, WrongUseIsRefusedBeforeTheWork) {
  const Folder folder;
  folder.write("d.csv", text_of(rows()));
  const auto refused = [&](const std::string& arguments, const std::string& message) {
    const Outcome outcome = folder.run(llmt_program + " fit d.csv -t y " + arguments);
    EXPECT_EQ(outcome.exit_code, 2) << arguments << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_NE(outcome.err.find(message), std::string::npos) << outcome.err;
  };
  for (const char* value : {"nan", "-1", "inf", "ten"}) {
    refused(fmt::format("--readable={}", value),
            fmt::format("--readable is \"{}\", it must be a number of per cent from 0 to 1000", value));
  }
  refused("--readable --cv 0", "--readable does not go with --cv 0");
  refused("--readable --validity blend", "--readable does not go with --validity blend");
  refused("--readable --rule lolimot", "--readable does not go with --rule lolimot");
  for (const char* value : {"0", "-2", "1.5", "few"})
    refused(fmt::format("--readable-rules {}", value), "--readable-rules");
  refused("--readable-rules 3 --stream", "--readable-rules is not for --stream");
  refused("--readable --stream", "--readable is not for --stream");
}

TEST(ReadableProgram, ARowAloneLeavesNoneToHoldOut) {
  const Folder folder;
  folder.write("one.csv", "x,y\n1,2\n");
  const Outcome outcome = folder.run(llmt_program + " fit one.csv -t y --readable");
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  EXPECT_NE(outcome.err.find("one.csv: --readable chooses on held-out rows"), std::string::npos) << outcome.err;
  EXPECT_EQ(outcome.err.find("::"), std::string::npos) << outcome.err;
}

TEST(ReadableProgram, RulesOfABlendAreRefusedAndOfOtherTreesSayWhatTheyLeaveOut) {
  const Folder folder;
  folder.write("d.csv", text_of(rows()));
  ASSERT_EQ(folder.run(llmt_program + " fit d.csv -t y -o blend.json --validity blend --cv 3").exit_code, 0);
  const Outcome blend = folder.run(llmt_program + " inspect blend.json --rules");
  EXPECT_EQ(blend.exit_code, 1);
  EXPECT_EQ(blend.out, "");
  EXPECT_NE(blend.err.find("blended"), std::string::npos) << blend.err;
  ASSERT_EQ(folder.run(llmt_program + " fit d.csv -t y -o crisp.json --validity crisp --cv 3").exit_code, 0);
  const Outcome crisp = folder.run(llmt_program + " inspect crisp.json --rules");
  EXPECT_EQ(crisp.exit_code, 0) << crisp.err;
  EXPECT_NE(crisp.out.find("the slopes of larger regions take"), std::string::npos) << crisp.out;
  EXPECT_EQ(folder.run(llmt_program + " inspect crisp.json --rules --json").exit_code, 2);
}

}  // namespace
