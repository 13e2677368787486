// A growth rule is a folder and a row: this folder has both, table.cpp the row.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "llmt/compare.hpp"
#include "llmt/fit.hpp"
#include "oracles/oracles.hpp"

namespace {

llmt::FitOptions toy_options() {
  llmt::FitOptions options;
  options.rule = llmt::parse<llmt::GrowthRule>("toy");
  return options;
}

TEST(ToyRule, IsListedBehindTheLibrarysRules) {
  EXPECT_EQ(llmt::list_names<llmt::GrowthRule>(), "rd, retis, lolimot, lolimot-data, ra, m5, hilomot, toy");
  EXPECT_EQ(llmt::name_of(toy_options().rule), "toy");
  EXPECT_EQ(llmt::summary_of(toy_options().rule), "halves the rows");
  const std::vector<llmt::Method> methods = llmt::usual_methods();
  EXPECT_EQ(std::ranges::count(methods, "toy", &llmt::Method::name), 1);
}

TEST(ToyRule, HalvesTheRowsAtTheMedianOfTheFirstInput) {
  const Eigen::MatrixXd x = oracle::uniform(400, 2, 5);
  llmt::FitOptions options = toy_options();
  options.validity = llmt::ValidityChoice::crisp;
  options.folds.count = 0;
  options.max_leaves = 4;
  const llmt::Model model = llmt::fit(x, oracle::curved(x), options).model;
  const llmt::Node& root = model.partitions()[0].nodes[0];
  EXPECT_EQ(root.split_input, 0);
  EXPECT_EQ((x.col(0).array() <= root.threshold).count(), 200);
  for (const llmt::Leaf& leaf : model.leaves(0)) EXPECT_EQ(leaf.samples, 100);
}

TEST(ToyRule, IsBlendedPredictedSavedAndLoadedLikeAnyOther) {
  const Eigen::MatrixXd x = oracle::uniform(300, 2, 6);
  const Eigen::VectorXd y = (3.0 * x.col(0).array()).sin();
  const llmt::FitResult result = llmt::fit(x, y, toy_options());
  const llmt::PartitionSummary& summary = result.summary.partitions[0];
  EXPECT_GT(summary.leaves, 1);
  EXPECT_LT(summary.chosen.rmse, 0.5 * summary.best_of_kind[0].rmse);  // of least squares
  const std::string text = llmt::to_json(result.model);
  EXPECT_EQ(llmt::from_json(text).predict(x), result.model.predict(x));
  llmt::FitOptions one_thread = toy_options();
  one_thread.max_threads = 1;
  EXPECT_EQ(llmt::to_json(llmt::fit(x, y, one_thread).model), text);
}

TEST(ToyRule, TheTablesOrderIsThatOfTheEnumeration) {
  using llmt::GrowthRule;
  EXPECT_EQ(llmt::name_of(GrowthRule::rd), "rd");
  EXPECT_EQ(llmt::name_of(GrowthRule::retis), "retis");
  EXPECT_EQ(llmt::name_of(GrowthRule::lolimot), "lolimot");
  EXPECT_EQ(llmt::name_of(GrowthRule::lolimot_data_driven), "lolimot-data");
  EXPECT_EQ(llmt::name_of(GrowthRule::ra), "ra");
  EXPECT_EQ(llmt::name_of(GrowthRule::m5), "m5");
  EXPECT_EQ(llmt::name_of(GrowthRule::hilomot), "hilomot");
}

}  // namespace
