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

// 300 rows: y has a kink in `a`, z is affine, `label` is words.
std::string labelled_table() {
  llmt::Random random(1);
  std::string text = "label,a,b,y,z\n";
  for (int i = 0; i < 300; ++i) {
    const double a = random.uniform(-1.0, 1.0);
    const double b = random.uniform(0.0, 100.0);
    text += fmt::format("row {},{},{},{},{}\n", i, a, b, std::abs(a) + 0.01 * b + 0.01 * random.normal(), 2.0 * a - b);
  }
  return text;
}

// 240 rows: y = x, but 3 - x for blue; every 20th colour and every 12th x is missing.
std::string coloured() {
  llmt::Random random(3);
  const std::vector<std::string> colours = {"red", "green", "blue"};
  std::string text = "colour,x,y\n";
  for (int i = 0; i < 240; ++i) {
    const std::string& colour = colours[i % 3];
    const double x = random.uniform(-1.0, 1.0);
    const double y = (colour == "blue" ? 3.0 - x : x) + 0.05 * random.normal();
    text += fmt::format("{},{},{}\n", i % 20 == 7 ? "" : colour, i % 12 == 5 ? "NA" : fmt::format("{}", x), y);
  }
  return text;
}

// 200 rows: y = (a - b)^2 + c with normal noise of 0.05.
std::string bent() {
  llmt::Random random(4);
  std::string text = "a,b,c,y\n";
  for (int i = 0; i < 200; ++i) {
    const double a = random.uniform(-1.0, 1.0);
    const double b = random.uniform(1.0, 3.0);
    const double c = random.uniform(-1.0, 1.0);
    text += fmt::format("{},{},{},{}\n", a, b, c, (a - b) * (a - b) + c + 0.05 * random.normal());
  }
  return text;
}

TEST(LlmtProgram, OutliersAreNamedRefusedAndLeftOut) {
  const Folder folder;
  std::string text = labelled_table();
  const std::size_t third_line = text.find("row 1,");
  const std::size_t value = text.rfind(',', text.rfind(',', text.find('\n', third_line)) - 1) + 1;
  const auto with = [&](const char* written) {
    std::string changed = text;
    const std::size_t end = changed.find(',', value);
    return changed.replace(value, end - value, written);
  };
  folder.write("far.csv", with("5000"));
  folder.write("absurd.csv", with("1e30"));
  const std::string fit = llmt_program + " fit --target y --ignore label,z --validity crisp ";
  const Outcome warned = folder.run(fit + "far.csv");
  EXPECT_EQ(warned.exit_code, 0) << warned.err;
  EXPECT_NE(warned.err.find("1 of 300 rows carries"), std::string::npos) << warned.err;
  EXPECT_NE(warned.err.find("line 3 (5000)"), std::string::npos) << warned.err;
  const Outcome refused = folder.run(fit + "absurd.csv");
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(refused.err.find("absurd.csv:3: column \"y\": 1e+30"), std::string::npos) << refused.err;
  const Outcome robust = folder.run(fit + "absurd.csv --loss tukey --json");
  ASSERT_EQ(robust.exit_code, 0) << robust.err;
  EXPECT_EQ(robust.err, "");
  EXPECT_EQ(json::parse(robust.out)["rows_left_out"][0], 2);
}

TEST(LlmtProgram, LocalModelsAreQuadraticAndSparseWhereAsked) {
  const Folder folder;
  folder.write("d.csv", bent());
  const std::string fit = llmt_program + " fit d.csv --target y --validity crisp -o m.json ";
  const Outcome chosen = folder.run(fit + "--local-models auto --sparse always --json");
  ASSERT_EQ(chosen.exit_code, 0) << chosen.err;
  const json summary = json::parse(chosen.out);
  EXPECT_EQ(summary["local_models"], "quadratic");
  const json& partition = summary["partitions"][0];
  EXPECT_EQ(partition["leaves"], 1);
  EXPECT_EQ(partition["chosen"]["sparse"], true);
  EXPECT_LT(partition["coefficients"], 10);
  EXPECT_GT(partition["other_terms"]["cv_rmse"], partition["cv_rmse"]);
  const std::string leaves = folder.run(llmt_program + " inspect m.json").out;
  EXPECT_NE(leaves.find("^2"), std::string::npos) << leaves;
  EXPECT_NE(leaves.find(")*(b - "), std::string::npos) << leaves;
  EXPECT_EQ(folder.run(llmt_program + " explain m.json d.csv --row 3").exit_code, 0);
  const std::string text = folder.run(fit + "--local-models auto --sparse always").out;
  EXPECT_NE(text.find("Local models are quadratic; linear ones: RMSE held-out"), std::string::npos) << text;
  EXPECT_NE(text.find("Sparse local models:"), std::string::npos) << text;
  const std::string usual = folder.run(fit).out;
  EXPECT_EQ(usual.find("ocal models"), std::string::npos) << usual;
  EXPECT_EQ(folder.run(fit + "--local-models cubic").exit_code, 2);
}

TEST(LlmtProgram, FitPredictInspectAgreeWithTheLibrary) {
  const Folder folder;
  const llmt::Csv csv = llmt::Csv::read(folder.write("d.csv", labelled_table()));
  const Outcome fitted = folder.run(llmt_program + " fit d.csv --target y --target z --ignore label -o m.json --json");
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  EXPECT_EQ(fitted.err, "");
  const json summary = json::parse(fitted.out);
  EXPECT_GT(summary["partitions"][0]["leaves"], 1);
  EXPECT_LT(summary["partitions"][0]["cv_rmse"], 0.02);
  EXPECT_GT(summary["partitions"][0]["cv_rmse_least_squares"], 0.2);
  EXPECT_EQ(summary["partitions"][1]["leaves"], 1);
  EXPECT_EQ(summary["missing_values"], 0);
  EXPECT_EQ(summary["inputs"], (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(summary["model"], "m.json");
  for (const json& partition : summary["partitions"]) {
    EXPECT_EQ(partition["cv_folds"], 5);
    EXPECT_EQ(partition["chosen"]["leaves"], partition["leaves"]);
    EXPECT_EQ(partition["chosen"]["cv_rmse"], partition["cv_rmse"]);
    EXPECT_EQ(partition["compared"][0]["leaves"], 1);
    EXPECT_EQ(partition["compared"][0]["cv_rmse"], partition["cv_rmse_least_squares"]);
    EXPECT_NEAR(partition["crisp_cv_rmse_by_leaves"][0], partition["cv_rmse_least_squares"], 1e-12);
    for (const json& other : partition["compared"]) {
      EXPECT_GE(other["cv_rmse"], partition["cv_rmse"]);
    }
  }

  const Eigen::MatrixXd inputs = csv.numbers(std::vector<std::string>{"a", "b"});
  const Eigen::MatrixXd expected =
      llmt::fit(inputs, csv.numbers(std::vector<std::string>{"y", "z"})).model.predict(inputs);
  const Outcome predicted = folder.run(llmt_program + " predict m.json d.csv -o p.csv");
  ASSERT_EQ(predicted.exit_code, 0) << predicted.err;
  const llmt::Csv result = llmt::Csv::read(folder.file("p.csv"));
  EXPECT_EQ(result.columns(), (std::vector<std::string>{"label", "a", "b", "y", "z", "y_pred", "z_pred", "outside",
                                                        "outside_by", "leverage"}));
  EXPECT_EQ(result.numbers(std::vector<std::string>{"y_pred", "z_pred"}), expected);
  EXPECT_EQ(result.numbers("outside").sum(), 0.0);
  EXPECT_GT(result.numbers("leverage").minCoeff(), 0.0);
  EXPECT_LT(result.numbers("leverage").maxCoeff(), 1.0);
  EXPECT_TRUE(result.row_text(7).starts_with("row 7,"));

  const Outcome inspected = folder.run(llmt_program + " inspect m.json --json");
  ASSERT_EQ(inspected.exit_code, 0) << inspected.err;
  EXPECT_EQ(json::parse(inspected.out)["partitions"][0]["leaves"].size(), summary["partitions"][0]["leaves"]);
  EXPECT_NE(folder.run(llmt_program + " inspect m.json").out.find("everywhere"), std::string::npos);
}

TEST(LlmtProgram, QueriesOutsideTheTrainingExtentAreFlagged) {
  const Folder folder;
  folder.write("d.csv", "x,y\n0,0\n1,1\n2,2\n3,3\n4,4\n");
  folder.write("q.csv", "other,x\nfar,6\nin,2\n");
  ASSERT_EQ(folder.run(llmt_program + " fit d.csv -t y -o m.json").exit_code, 0);
  const Outcome predicted = folder.run(llmt_program + " predict m.json q.csv");
  const llmt::Csv result = llmt::Csv::parse(predicted.out, "out");
  EXPECT_EQ(result.columns(), (std::vector<std::string>{"other", "x", "y_pred", "outside", "outside_by", "leverage"}));
  EXPECT_TRUE(result.row_text(0).starts_with("far,6,6,1,0.5,"));
  EXPECT_TRUE(result.row_text(1).starts_with("in,2,2,0,0,"));
  EXPECT_NEAR(result.numbers("leverage")(0), 1.0 / 5.0 + 16.0 / 10.0, 1e-6);  // one leaf: 1/n + (x - mean)^2 / sum
  EXPECT_NEAR(result.numbers("leverage")(1), 1.0 / 5.0, 1e-6);
  EXPECT_NE(predicted.err.find("1 outside the range of the training rows"), std::string::npos);
}

TEST(LlmtProgram, MistakesHaveTheirExitCodeAndMessage) {
  const Folder folder;
  folder.write("d.csv", labelled_table());
  folder.write("h.csv", "a,y\n");
  folder.write("cut.csv", "a,y\n1,2\n3");
  folder.write("word.csv", "a,b,y\n1,2,3\n4,x,6\n7,8,9\n");
  folder.write("gap.csv", "a,y\n1,2\n3,\n");
  const auto expect = [&](const std::string& arguments, int code, const std::string& message) {
    const Outcome outcome = folder.run(llmt_program + " " + arguments);
    EXPECT_EQ(outcome.exit_code, code) << arguments;
    EXPECT_EQ(outcome.out, "") << arguments;
    EXPECT_NE(outcome.err.find(message), std::string::npos) << arguments << ": " << outcome.err;
  };
  expect("", 2, "a command is needed");
  expect("fit d.csv", 2, "--target is required: what to predict; the columns of d.csv are label, a, b, y, z");
  expect("fit", 2,
         "data is required (CSV file with a header row; - is standard input); usage: llmt fit [OPTIONS] data");
  expect("predict m.json d.csv --interval 90", 2, "it must be a number from 0.01 to 0.9999; 90 % is 0.9");
  expect("predict m.json d.csv --interval 900", 2, "it must be a number from 0.01 to 0.9999\n");
  expect("fit d.csv -t y --rule cart", 2, "cart");
  expect("fit d.csv -t y --ignore label --rule m5 --validity blend", 2, "with --rule m5 it must be auto or crisp");
  expect("fit d.csv -t y --monotone label", 2, "--monotone names \"label\", which is categorical");
  expect("fit d.csv -t y --ignore label --monotone a,-a", 2, "--monotone names \"a\" with both signs");
  expect("fit d.csv -t y --ignore label --monotone a --slope-sign=-a", 2,
         "--monotone and --slope-sign name \"a\" with opposite signs");
  expect("fit d.csv -t y --ignore label --cv 1", 2, "--cv is 1");
  expect("fit d.csv -t y --ignore label --width -1", 2, "--width is \"-1\", it must be a finite number above 0");
  expect("fit d.csv -t y --ignore label --categorical nope", 1, "\"nope\" is categorical, but not an input");
  expect("fit d.csv -t y --ignore label --split-inputs nope", 2, "\"nope\", which is not among the inputs a, b, z");
  expect("fit word.csv -t y", 1,
         "word.csv:3: column \"b\": 'x' is not a number; all other cells of the column are numbers or empty");
  expect("fit gap.csv -t y", 1, "gap.csv:3: column \"y\": the cell is empty, a number is needed");
  expect("fit d.csv -t w", 1, "there is no column \"w\"; the columns are label, a, b, y, z");
  expect("fit h.csv -t y", 1, "h.csv: there is a header and no rows");
  expect("fit cut.csv -t y", 1, "cut.csv:3: the row has 1 field, the header has 2 (is the file cut off?)");
  expect("fit missing.csv -t y", 1, "missing.csv: cannot be read: No such file or directory");
  expect("fit d.csv -t y --ignore label -o no/m.json", 1, "no/m.json: cannot be written");
  expect("predict d.csv d.csv", 1, "d.csv: this is a table; a model file (JSON) is expected");
  expect("compare d.csv -t y -t z --ignore label", 2, "compare takes one --target");
  EXPECT_EQ(folder.run(llmt_program + " fit --help").exit_code, 0);
}

TEST(LlmtProgram, WordsAreCategoriesAndCellsMayBeMissing) {
  const Folder folder;
  folder.write("d.csv", coloured());
  folder.write("q.csv", "colour,x\nred,0.5\nviolet,0.5\n,0.5\nblue,\nblue,0.5\n");
  const Outcome fitted = folder.run(llmt_program + " fit d.csv -t y --validity crisp --cv 3 -o m.json --json");
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  const json summary = json::parse(fitted.out);
  EXPECT_EQ(summary["missing_values"], 12 + 20);
  // What is missing leaves an error of 0.36 whatever the model.
  EXPECT_LT(summary["partitions"][0]["cv_rmse"], 0.8 * summary["partitions"][0]["cv_rmse_least_squares"].get<double>());

  const Outcome predicted = folder.run(llmt_program + " predict m.json q.csv --json");
  ASSERT_EQ(predicted.exit_code, 0) << predicted.err;
  const json values = json::parse(predicted.out);
  EXPECT_EQ(values["missing_values"], 2);
  EXPECT_EQ(values["unknown_categories"], 1);
  const std::vector<double> y = values["targets"][0]["predicted"];
  EXPECT_NEAR(y[0], 0.5, 0.15);
  // A category that was not there is like all of them, by their parts of the rows; an empty cell is a level.
  EXPECT_NEAR(y[1], (0.5 + 0.5 + 2.5) / 3.0, 0.2);
  EXPECT_NE(y[1], y[2]);
  EXPECT_NEAR(y[4], 2.5, 0.15);
  EXPECT_NE(
      folder.run(llmt_program + " predict m.json q.csv").err.find("1 value of categories that were not in training"),
      std::string::npos);

  const Outcome inspected = folder.run(llmt_program + " inspect m.json");
  ASSERT_EQ(inspected.exit_code, 0) << inspected.err;
  EXPECT_NE(inspected.out.find("4 categories: blue, green, red, (empty)"), std::string::npos);
  EXPECT_NE(inspected.out.find("colour = blue"), std::string::npos) << inspected.out;
  EXPECT_NE(inspected.out.find("colour not in {blue}"), std::string::npos) << inspected.out;
  const json leaves = json::parse(folder.run(llmt_program + " inspect m.json --json").out);
  EXPECT_EQ(leaves["inputs"][0]["levels"], (std::vector<std::string>{"blue", "green", "red", ""}));
  EXPECT_EQ(leaves["regressors"].back(), "x");
}

TEST(LlmtProgram, ExplanationsAddUp) {
  const Folder folder;
  folder.write("d.csv", coloured());
  ASSERT_EQ(folder.run(llmt_program + " fit d.csv -t y --cv 3 -o m.json").exit_code, 0);
  const json predicted = json::parse(folder.run(llmt_program + " predict m.json d.csv --json").out);
  for (const int row : {1, 6, 8}) {  // complete; without x; without a colour
    const Outcome explained = folder.run(fmt::format("{} explain m.json d.csv --row {} --json", llmt_program, row));
    ASSERT_EQ(explained.exit_code, 0) << explained.err;
    const json target = json::parse(explained.out)["targets"][0];
    EXPECT_EQ(target["name"], "y");
    double sum = target["reference"];
    for (const json& entry : target["contributions"]) {
      sum += entry["contribution"].get<double>();
      EXPECT_EQ(entry["value"].is_null(), row == 6 && entry["input"] == "x");
      if (row == 8 && entry["input"] == "colour") EXPECT_EQ(entry["value"], "(empty)");
    }
    EXPECT_NEAR(sum, target["prediction"], 1e-12);
    EXPECT_NEAR(target["prediction"], predicted["targets"][0]["predicted"][row - 1], 1e-12);
  }
  EXPECT_NE(folder.run(llmt_program + " explain m.json d.csv --row 6").out.find("The contributions add up:"),
            std::string::npos);
  const json table = json::parse(folder.run(llmt_program + " explain m.json d.csv --json").out);
  EXPECT_EQ(table["rows_used"], 240);
  EXPECT_EQ(table["targets"][0]["importance"][0]["input"], "colour");
  EXPECT_NEAR(table["targets"][0]["importance"][0]["importance"].get<double>() +
                  table["targets"][0]["importance"][1]["importance"].get<double>(),
              1.0, 1e-12);
}

TEST(LlmtProgram, AFailedWriteKeepsTheOldModel) {
  const Folder folder;
  folder.write("d.csv", "x,y\n0,0\n1,1\n2,3\n");
  folder.write("m.json", "old");
  EXPECT_EQ(folder.run(llmt_program + " fit d.csv -t z -o m.json").exit_code, 1);
  EXPECT_EQ(llmt::read_file(folder.file("m.json")), "old");
  EXPECT_EQ(folder.run(llmt_program + " fit d.csv -t y -o m.json").exit_code, 0);
  EXPECT_EQ(folder.run(llmt_program + " predict m.json d.csv >/dev/full").exit_code, 1);
}

TEST(LlmtProgram, SameBytesWhateverTheThreads) {
  const Folder folder;
  folder.write("d.csv", labelled_table());
  for (const char* threads : {"1", "2", "8"}) {
    ASSERT_EQ(folder
                  .run(fmt::format("{} fit d.csv -t y,z --ignore label --threads {} -o m{}.json", llmt_program, threads,
                                   threads))
                  .exit_code,
              0);
  }
  EXPECT_EQ(llmt::read_file(folder.file("m1.json")), llmt::read_file(folder.file("m2.json")));
  EXPECT_EQ(llmt::read_file(folder.file("m1.json")), llmt::read_file(folder.file("m8.json")));
}

}  // namespace
