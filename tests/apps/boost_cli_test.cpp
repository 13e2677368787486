#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/program.hpp"
#include "llmt/boosted.hpp"
#include "llmt/csv.hpp"
#include "llmt/random.hpp"
#include "llmt/training_data.hpp"

namespace {

using nlohmann::json;
using program::Folder;
using program::Outcome;

// y has a kink in `a` and depends on `colour`; a row in ten has no `a`.
std::string kinked_with_colours(int rows) {
  llmt::Random random(1);
  std::string text = "a,colour,y\n";
  for (int i = 0; i < rows; ++i) {
    const double a = random.uniform(-1.0, 1.0);
    const bool red = random.uniform() < 0.5;
    text += fmt::format("{},{},{}\n", i % 10 == 3 ? "" : fmt::format("{}", a), red ? "red" : "blue",
                        2.0 * std::abs(a) + (red ? 1.0 : 0.0) + 0.05 * random.normal());
  }
  return text;
}

// Writes d.csv and m.json, the sum fitted to it.
void fit_sum(const Folder& folder, int rows) {
  folder.write("d.csv", kinked_with_colours(rows));
  const Outcome fitted = folder.run(LLMT_PROGRAM " fit d.csv -t y --boost -o m.json");
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
}

TEST(BoostProgram, FitsAndPredictsAsTheLibrary) {
  const Folder folder;
  folder.write("d.csv", kinked_with_colours(300));
  const Outcome fitted = folder.run(LLMT_PROGRAM " fit d.csv -t y --boost -o m.json --json");
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  const json summary = json::parse(fitted.out);
  EXPECT_EQ(summary["sums"][0]["rows"], 300);
  EXPECT_LT(summary["sums"][0]["held_out_rmse"], 0.3);
  const llmt::BoostedModel model = llmt::load_boosted(folder.file("m.json"));
  EXPECT_EQ(model.inputs()[1].levels, (std::vector<std::string>{"blue", "red"}));

  folder.write("new.csv", "colour,a\nred,0.5\nblue,9\ngreen,\n");
  const Outcome predicted = folder.run(LLMT_PROGRAM " predict m.json new.csv");
  ASSERT_EQ(predicted.exit_code, 0) << predicted.err;
  const llmt::Csv answer = llmt::Csv::parse(predicted.out, "answer");
  EXPECT_EQ(answer.columns(), (std::vector<std::string>{"colour", "a", "y_pred", "outside", "outside_by"}));
  Eigen::MatrixXd inputs(3, 2);
  const double no_value = std::nan("");
  inputs << 0.5, 1.0, 9.0, 0.0, no_value, no_value;
  EXPECT_EQ(answer.numbers("y_pred"), model.predict(inputs).col(0));
  EXPECT_EQ(answer.numbers("outside"), (Eigen::Vector3d{0.0, 1.0, 0.0}));
}

TEST(BoostProgram, TakesASeed) {
  const Folder folder;
  ASSERT_NO_FATAL_FAILURE(fit_sum(folder, 60));
  for (const std::string seed : {"1", "2"}) {
    const Outcome fitted = folder.run(LLMT_PROGRAM " fit d.csv -t y --boost --seed " + seed + " -o " + seed + ".json");
    ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  }
  const auto model = [&](const char* name) { return to_json(llmt::load_boosted(folder.file(name))); };
  EXPECT_EQ(model("1.json"), model("m.json"));
  EXPECT_NE(model("2.json"), model("m.json"));
}

TEST(BoostProgram, TakesTheMeanOfSeveralSeeds) {
  const Folder folder;
  ASSERT_NO_FATAL_FAILURE(fit_sum(folder, 60));
  const Outcome fitted = folder.run(LLMT_PROGRAM " fit d.csv -t y --boost --seeds 2 -o two.json");
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  EXPECT_NE(fitted.out.find("the mean of those of 2 seeds"), std::string::npos) << fitted.out;
  const auto trees = [&](const char* name) { return llmt::size_of(llmt::load_boosted(folder.file(name))).trees; };
  EXPECT_GT(trees("two.json"), trees("m.json"));
  EXPECT_EQ(folder.run(LLMT_PROGRAM " fit d.csv -t y --boost --seeds 0").exit_code, 2);
  EXPECT_EQ(folder.run(LLMT_PROGRAM " fit d.csv -t y --seeds 2").exit_code, 2);
}

TEST(BoostProgram, RefusesByNameWhatIsForOneTree) {
  const Folder folder;
  ASSERT_NO_FATAL_FAILURE(fit_sum(folder, 60));
  folder.write("one.csv", "a,y\n1,2\n");
  const auto refused = [&](const std::string& command, const std::string& words) {
    const Outcome outcome = folder.run(LLMT_PROGRAM " " + command);
    EXPECT_NE(outcome.exit_code, 0) << command;
    EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
  };
  refused("fit d.csv -t y --boost --monotone a", "--monotone is not for --boost");
  refused("fit d.csv -t y --boost --readable", "--readable is not for --boost");
  refused("fit d.csv -t y --boost --stream", "--boost is not for --stream");
  refused("fit one.csv -t y --boost",
          "one.csv: 1 row; --boost needs at least 10 that differ, llmt fit without --boost takes fewer");
  refused("inspect m.json --rules", "m.json: --rules is not for a sum of trees");
  refused("predict m.json d.csv --interval 0.999", "m.json: level 0.999 needs at least 999 held-out rows, there are ");
}

TEST(BoostProgram, PredictsIntervals) {
  const Folder folder;
  ASSERT_NO_FATAL_FAILURE(fit_sum(folder, 300));
  const Outcome predicted = folder.run(LLMT_PROGRAM " predict m.json d.csv --interval 0.9");
  ASSERT_EQ(predicted.exit_code, 0) << predicted.err;
  const llmt::Csv answer = llmt::Csv::parse(predicted.out, "answer");
  const llmt::BoostedModel model = llmt::load_boosted(folder.file("m.json"));
  Eigen::MatrixXd inputs(answer.rows(), model.num_inputs());
  for (Eigen::Index j = 0; j < inputs.cols(); ++j) {
    const llmt::InputColumn& column = model.inputs()[j];
    inputs.col(j) = column.is_categorical() ? llmt::category_values(answer.texts(column.name), column.levels)
                                            : answer.numbers_or_missing(std::vector{column.name}).col(0).eval();
  }
  const llmt::Bounds bounds = model.intervals(inputs, 0.9);
  EXPECT_EQ(answer.numbers("y_low"), bounds.lower.col(0));
  EXPECT_EQ(answer.numbers("y_high"), bounds.upper.col(0));
}

TEST(BoostProgram, InspectsASum) {
  const Folder folder;
  ASSERT_NO_FATAL_FAILURE(fit_sum(folder, 100));
  const llmt::BoostedModel model = llmt::load_boosted(folder.file("m.json"));
  const llmt::BoostedSize size = size_of(model);
  const Outcome shown = folder.run(LLMT_PROGRAM " inspect m.json");
  ASSERT_EQ(shown.exit_code, 0) << shown.err;
  EXPECT_NE(shown.out.find(fmt::format("times the sum of {} trees with {} leaves", size.trees, size.leaves)),
            std::string::npos)
      << shown.out;
  const json all = json::parse(folder.run(LLMT_PROGRAM " inspect m.json --json").out);
  EXPECT_EQ(all["parameters"], size.parameters);
  EXPECT_EQ(all["sums"][0]["splits"], size.leaves - size.trees);
}

// Inputs of d.csv, colours as the model numbers them.
Eigen::MatrixXd inputs_of(const Folder& folder) {
  const llmt::Csv csv = llmt::Csv::read(folder.file("d.csv"));
  Eigen::MatrixXd inputs(csv.rows(), 2);
  inputs.col(0) = csv.numbers_or_missing(std::vector<std::string>{"a"});
  const std::vector<std::string> colours = csv.texts("colour");
  for (std::size_t i = 0; i < colours.size(); ++i) inputs(static_cast<int>(i), 1) = colours[i] == "red" ? 1.0 : 0.0;
  return inputs;
}

// The Shapley values of both inputs by their definition: what an input changes if it comes first and if it comes
// second, each half, where inputs that have not come are those of the background.
Eigen::Vector2d shapley(const llmt::BoostedModel& model, const Eigen::RowVector2d& row,
                        const Eigen::MatrixXd& background) {
  const auto value = [&](bool with_a, bool with_colour) {
    Eigen::MatrixXd mixed = background;
    if (with_a) mixed.col(0).setConstant(row(0));
    if (with_colour) mixed.col(1).setConstant(row(1));
    return model.predict(mixed).mean();
  };
  const double none = value(false, false);
  const double a = value(true, false);
  const double colour = value(false, true);
  const double both = value(true, true);
  return {(a - none + both - colour) / 2.0, (colour - none + both - a) / 2.0};
}

TEST(BoostProgram, ExplainsRowsAndTables) {
  const Folder folder;
  ASSERT_NO_FATAL_FAILURE(fit_sum(folder, 150));
  const llmt::BoostedModel model = llmt::load_boosted(folder.file("m.json"));
  const Eigen::MatrixXd inputs = inputs_of(folder);
  const auto evenly_spaced = [&](int count) {
    Eigen::MatrixXd rows(count, 2);
    for (int k = 0; k < count; ++k) rows.row(k) = inputs.row(k * 150 / count);
    return rows;
  };
  const Outcome of_row = folder.run(LLMT_PROGRAM " explain m.json d.csv --row 2 --json");
  ASSERT_EQ(of_row.exit_code, 0) << of_row.err;
  const json target = json::parse(of_row.out)["targets"][0];
  EXPECT_NEAR(target["prediction"].get<double>(), model.predict(inputs.row(1))(0), 1e-12);
  EXPECT_NEAR(target["reference"].get<double>(), model.predict(evenly_spaced(100)).mean(), 1e-12);
  const Eigen::Vector2d expected = shapley(model, inputs.row(1), evenly_spaced(100));
  EXPECT_GT(expected.cwiseAbs().minCoeff(), 0.05) << "would prove little";
  ASSERT_EQ(target["contributions"].size(), 2);
  for (const json& entry : target["contributions"]) {
    EXPECT_NEAR(entry["contribution"].get<double>(), expected(entry["input"] == "a" ? 0 : 1), 1e-11) << entry;
  }
  const Outcome text = folder.run(LLMT_PROGRAM " explain m.json d.csv --row 2");
  EXPECT_NE(text.out.find("on average over 100 rows of the table"), std::string::npos) << text.out;
  const json table = json::parse(folder.run(LLMT_PROGRAM " explain m.json d.csv --json").out);
  EXPECT_EQ(table["rows_used"], 150);
  Eigen::Vector2d shares = Eigen::Vector2d::Zero();
  for (int i = 0; i < 150; ++i) shares += shapley(model, inputs.row(i), evenly_spaced(20)).cwiseAbs();
  shares /= shares.sum();
  ASSERT_EQ(table["targets"][0]["importance"].size(), 2);
  for (const json& entry : table["targets"][0]["importance"]) {
    EXPECT_NEAR(entry["importance"].get<double>(), shares(entry["input"] == "a" ? 0 : 1), 1e-11) << entry;
  }
}

TEST(BoostProgram, IsComparedWithOneTree) {
  const Folder folder;
  folder.write("d.csv", kinked_with_colours(120));
  folder.write("few.csv", kinked_with_colours(30));
  const Outcome compared = folder.run(LLMT_PROGRAM " compare d.csv -t y --cv 2 --json");
  ASSERT_EQ(compared.exit_code, 0) << compared.err;
  const json sum = json::parse(compared.out)["methods"].back();
  EXPECT_EQ(sum["method"], "sum of trees");
  EXPECT_GT(sum["trees"], 1);
  EXPECT_GT(sum["parameters"], sum["leaves"]);
  EXPECT_TRUE(sum["largest_jump"].is_null());
  EXPECT_LT(sum["cv_rmse"], 0.5);
  const Outcome text = folder.run(LLMT_PROGRAM " compare d.csv -t y --cv 2");
  EXPECT_NE(text.out.find("One tree ("), std::string::npos) << text.out;
  EXPECT_NE(text.out.find(", sum of trees "), std::string::npos) << text.out;
  const Outcome few = folder.run(LLMT_PROGRAM " compare few.csv -t y --cv 2");
  EXPECT_NE(few.out.find("A sum of trees (--boost) is not compared: fewer than 40 different rows."), std::string::npos)
      << few.out;
  std::string repeats = "a,y\n";  // of few inputs
  for (int i = 0; i < 60; ++i) repeats += fmt::format("{},{}\n", i % 6, i);
  folder.write("repeats.csv", repeats);
  const Outcome of_repeats = folder.run(LLMT_PROGRAM " compare repeats.csv -t y --cv 2");
  EXPECT_NE(of_repeats.out.find("is not compared: fewer than 10 groups of rows"), std::string::npos) << of_repeats.out;
}

TEST(BoostProgram, ExportsC) {
  const Folder folder;
  ASSERT_NO_FATAL_FAILURE(fit_sum(folder, 60));
  const Outcome exported = folder.run(LLMT_PROGRAM " export --c m.json -o m.c --name sum");
  ASSERT_EQ(exported.exit_code, 0) << exported.err;
  EXPECT_NE(llmt::read_file(folder.file("m.c")).find("int sum_predict(const double *inputs, double *outputs)"),
            std::string::npos);
}

}  // namespace
