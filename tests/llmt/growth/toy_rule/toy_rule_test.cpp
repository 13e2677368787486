// A growth rule is a folder and a row: this folder has both, table.cpp the row.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "llmt/compare.hpp"
#include "llmt/fit.hpp"
#include "oracles/oracles.hpp"
#include "oracles/predict_oracle.hpp"

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

double rmse(const Eigen::MatrixXd& predicted, const Eigen::MatrixXd& y) {
  return std::sqrt((predicted - y).squaredNorm() / static_cast<double>(y.rows()));
}

Eigen::MatrixXd with_one(const Eigen::MatrixXd& x) {
  Eigen::MatrixXd result(x.rows(), x.cols() + 1);
  result << Eigen::VectorXd::Ones(x.rows()), x;
  return result;
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
  // In each quarter of the rows the local model is their least squares.
  std::vector<int> order(400);
  std::iota(order.begin(), order.end(), 0);
  std::ranges::sort(order, {}, [&](int row) { return x(row, 0); });
  const std::vector<llmt::Leaf> leaves = model.leaves(0);
  ASSERT_EQ(leaves.size(), 4U);
  for (int quarter = 0; quarter < 4; ++quarter) {
    const Eigen::MatrixXd rows = x(order, Eigen::all).middleRows(100 * quarter, 100);
    const Eigen::VectorXd expected = oracle::least_squares(with_one(rows), oracle::curved(rows));
    EXPECT_NEAR(leaves[quarter].intercept(0), expected(0), 1e-12) << quarter;
    EXPECT_LT((leaves[quarter].slope.transpose() - expected.tail(2)).norm(), 1e-12) << quarter;
  }
}

TEST(ToyRule, IsBlendedPredictedSavedAndLoadedLikeAnyOther) {
  const Eigen::MatrixXd x = oracle::uniform(300, 2, 6);
  const auto measured = [](const Eigen::MatrixXd& rows, std::uint64_t seed) {
    llmt::Random random(seed);
    Eigen::VectorXd values = (3.0 * rows.col(0).array()).sin();
    for (double& value : values) value += 0.1 * random.normal();
    return values;
  };
  const Eigen::VectorXd y = measured(x, 1);
  const llmt::FitResult result = llmt::fit(x, y, toy_options());
  const llmt::PartitionSummary& summary = result.summary.partitions[0];
  EXPECT_GT(summary.leaves, 1);
  EXPECT_LT((result.model.predict(x) - oracle::predict_rows(result.model, x)).cwiseAbs().maxCoeff(), 1e-12);
  // Held-out errors are those of rows that the fit has not seen.
  const Eigen::MatrixXd fresh = oracle::uniform(4000, 2, 7);
  const Eigen::VectorXd of_fresh = measured(fresh, 2);
  const double of_tree = rmse(result.model.predict(fresh), of_fresh);
  const double of_plane = rmse(with_one(fresh) * oracle::least_squares(with_one(x), y), of_fresh);
  EXPECT_NEAR(summary.chosen.rmse / of_tree, 1.0, 0.1);
  EXPECT_NEAR(summary.best_of_kind[0].rmse / of_plane, 1.0, 0.1);
  EXPECT_LT(of_tree, 0.12);  // of 0.1 of noise
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
