// One accurate tree as a part of a sum.
#include "boosted/one_tree.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "boosted/model/boosted_checks.hpp"
#include "llmt/boosted.hpp"
#include "llmt/fit.hpp"
#include "llmt/random.hpp"

namespace one_tree_test {
namespace {

// A smooth function of three of the inputs, whose units and zeros differ.
llmt::TrainingData smooth(Eigen::Index rows, Eigen::Index inputs, double noise, std::uint64_t seed) {
  llmt::Random random(seed);
  llmt::TrainingData data;
  data.inputs.resize(rows, inputs);
  data.outputs.resize(rows, 1);
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (Eigen::Index j = 0; j < inputs; ++j) data.inputs(i, j) = random.uniform();
    const auto x = data.inputs.row(i);
    data.outputs(i, 0) = 3.0 * std::sin(3.0 * x(0)) * x(1) + 4.0 * x(2) * x(2) + noise * random.normal();
  }
  for (Eigen::Index j = 0; j < inputs; ++j) {
    data.inputs.col(j) = 300.0 + std::pow(10.0, static_cast<double>(j % 3)) * data.inputs.col(j).array();
  }
  return data;
}

double rmse(const Eigen::VectorXd& errors) {
  return std::sqrt(errors.squaredNorm() / static_cast<double>(errors.size()));
}

TEST(OneTree, IsTheBlendOfLocalModelsWithoutGuards) {
  const llmt::TrainingData data = smooth(300, 4, 0.05, 1);
  const llmt::BoostingData rows = llmt::boosting_data(data, {});
  const Eigen::VectorXd output = data.outputs.col(0);
  const llmt::Progress nobody;
  llmt::Work work(nobody);
  const auto one = llmt::one_tree(rows, output, 1, work);
  ASSERT_TRUE(one.has_value());
  llmt::TrainingData given{data.inputs, data.outputs};
  given.groups.assign(rows.parts.begin(), rows.parts.end());
  given.may_have_codes = false;
  llmt::FitOptions options;
  options.rule = llmt::GrowthRule::ra;
  options.max_leaves = 24;
  const llmt::FitResult fitted = llmt::fit(given, options);
  const llmt::Partition& partition = fitted.model.partitions().front();
  ASSERT_EQ(partition.validity.kind, llmt::ValidityKind::blend);
  ASSERT_GT(partition.num_leaves(), 3);
  const Eigen::MatrixXd validities = fitted.model.validities(data.inputs, 0);
  Eigen::VectorXd expected = Eigen::VectorXd::Zero(output.size());
  const std::vector<llmt::Leaf> leaves = fitted.model.leaves(0);
  for (std::size_t k = 0; k < leaves.size(); ++k) {
    const llmt::Node& node = partition.nodes[leaves[k].node];
    Eigen::VectorXd local = Eigen::VectorXd::Constant(output.size(), node.value(0));
    for (Eigen::Index r = 0; r < node.slope.cols(); ++r) {
      const llmt::Regressor& regressor = fitted.model.regressors()[r];
      local += node.slope(0, r) * (data.inputs.col(regressor.input).array() - regressor.centre).matrix();
    }
    expected += validities.col(static_cast<Eigen::Index>(k)).cwiseProduct(local);
  }
  for (Eigen::Index i = 0; i < output.size(); ++i) {
    std::vector<double> z;
    for (std::size_t j = 0; j < 4; ++j)
      z.push_back((data.inputs(i, rows.columns[j]) - rows.inputs[j].centre) / rows.deviations[j]);
    EXPECT_NEAR(llmt::value_of(one->tree, z.data()), expected(i), 1e-9);
  }
  // Its guards are other ones, but the error is nearly that which fit() says.
  EXPECT_NEAR(rmse(one->residuals), fitted.summary.partitions[0].chosen.rmse,
              0.1 * fitted.summary.partitions[0].chosen.rmse);
}

// The other 39 rows are linear without noise. A model that has seen the row leaves less than 1000 (1 - 1/40) of it.
TEST(OneTree, LeavesResidualsOfRowsThatItHasNotSeen) {
  llmt::TrainingData data = smooth(40, 3, 0.0, 2);
  data.outputs.col(0) = data.inputs.col(0) - data.inputs.col(2);
  data.outputs(17, 0) += 1000.0;
  const llmt::BoostingData rows = llmt::boosting_data(data, {});
  const llmt::Progress nobody;
  llmt::Work work(nobody);
  const auto one = llmt::one_tree(rows, data.outputs.col(0), 1, work);
  ASSERT_TRUE(one.has_value());
  EXPECT_NEAR(one->residuals(17), 1000.0, 10.0);
  const llmt::HoldOut& apart = rows.hold_outs[rows.parts[17]];
  const auto tried = llmt::try_tree(rows, data.outputs.col(0), apart, llmt::by_ra, 1, work);
  ASSERT_TRUE(tried.has_value());
  ASSERT_EQ(tried->residuals.size(), std::ssize(apart.held_out));
  EXPECT_NEAR(tried->residuals.cwiseAbs().maxCoeff(), 1000.0, 10.0);
}

// With what the held-out rows chose, but without them, the same tree is grown anew. Of ten inputs five have no effect
// and are left out, which moves the smallest leaf.
TEST(OneTree, OfAllRowsIsMadeAsTheTriedOne) {
  const llmt::TrainingData data = smooth(700, 10, 0.02, 3);
  const llmt::BoostingData rows = llmt::boosting_data(data, {});
  const llmt::Progress nobody;
  llmt::Work work(nobody);
  const llmt::HoldOut& apart = rows.hold_outs.front();
  const auto tried = llmt::try_tree(rows, rows.y.col(0), apart, llmt::by_ra, 1, work);
  ASSERT_TRUE(tried.has_value());
  EXPECT_LT(std::ssize(tried->options.split_inputs), 10);
  EXPECT_GT(tried->options.max_leaves, 5);
  const llmt::FitResult again = llmt::fit(rows.x(apart.train, Eigen::all), rows.y(apart.train, 0), tried->options);
  const Eigen::VectorXd left = rows.y(apart.held_out, 0) - again.model.predict(rows.x(apart.held_out, Eigen::all));
  // The guards of fit() are not those of the tried tree, so a few rows may differ. The joint estimate's small ridge
  // magnifies rounding.
  Eigen::VectorXd differences = (left - tried->residuals).cwiseAbs();
  std::ranges::sort(differences);
  EXPECT_LT(differences(differences.size() * 9 / 10), 1e-6);
  const auto of_all = llmt::tree_of_all(rows, rows.y.col(0), *tried, work);
  ASSERT_TRUE(of_all.has_value());
  EXPECT_EQ(std::ssize(of_all->leaves), tried->options.max_leaves);
}

TEST(OneTree, IsNotThereWhereASumCannotSayIt) {
  llmt::TrainingData data = smooth(100, 3, 0.1, 4);
  const llmt::Progress nobody;
  const auto has_one = [&] {
    llmt::Work work(nobody);
    const llmt::BoostingData rows = llmt::boosting_data(data, {});
    return llmt::one_tree(rows, rows.y.col(0), 1, work).has_value();
  };
  EXPECT_TRUE(has_one());
  data.inputs(7, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(has_one());
  data = smooth(100, 3, 0.1, 4);
  for (Eigen::Index i = 0; i < 100; ++i) data.inputs(i, 1) = static_cast<double>(i % 3);
  data.categorical_inputs = {1};
  EXPECT_FALSE(has_one());
  data = smooth(100, 101, 0.1, 4);
  EXPECT_FALSE(has_one());
}

// Smooth, with inputs that have no effect: the tree leaves them out.
TEST(FitBoosted, TakesOneTreeWhereItIsBetter) {
  const llmt::TrainingData data = smooth(700, 10, 0.05, 5);
  const llmt::BoostResult fitted = llmt::fit_boosted(data);
  const llmt::BoostSummary& summary = fitted.summaries[0];
  ASSERT_GT(summary.compared.size(), 2U);  // those of the race, then the two with all their trees
  const llmt::BoostVariant& sum = summary.compared.end()[-2];
  EXPECT_EQ(summary.compared.back().name, "one tree");
  EXPECT_GT(summary.compared.back().share, 0.5);
  EXPECT_LT(summary.rmse, 0.9 * sum.rmse);
  const llmt::TrainingData fresh = smooth(2000, 10, 0.0, 6);
  const double error = rmse(fitted.model.predict(fresh.inputs).col(0) - fresh.outputs.col(0));
  EXPECT_LT(std::hypot(error, 0.05), 1.1 * summary.rmse);
  EXPECT_GT(std::hypot(error, 0.05), 0.8 * summary.rmse);
}

// Groups may be held out that are too few rows for the sum to be fitted to all; the tree beside it is.
TEST(FitBoosted, SaysTheErrorOfAllRowsWhereOneTreeIsBesideASumOfSome) {
  llmt::TrainingData data = smooth(700, 4, 0.05, 5);
  for (int row = 0; row < 700; ++row) data.groups.push_back(row < 20 ? 0 : 1 + row % 4);
  llmt::BoostOptions options{.max_rounds = 30};
  llmt::BoostResult fitted = llmt::fit_boosted(data, options);
  for (; fitted.summaries[0].rows != 680; ++options.seed) {
    ASSERT_LT(options.seed, 50U);
    fitted = llmt::fit_boosted(data, options);
  }
  const llmt::BoostSummary& summary = fitted.summaries[0];
  EXPECT_EQ(summary.held_out, 700);
  ASSERT_GT(summary.compared.back().share, 0.0);
  ASSERT_GT(summary.compared.end()[-2].share, 0.0);
  EXPECT_NEAR(summary.train_rmse, rmse(fitted.model.predict(data.inputs).col(0) - data.outputs.col(0)), 1e-5);
}

// The function of two inputs is another one on either side of a step in a third: RA does not see the step.
TEST(OneTree, IsGrownByTheRuleOfTheSmallerError) {
  llmt::TrainingData data = smooth(700, 3, 0.0, 9);
  for (Eigen::Index i = 0; i < 700; ++i) {
    const double a = data.inputs(i, 1) - 305.0;
    data.outputs(i, 0) = data.inputs(i, 0) < 300.4 ? a : -a;
  }
  const llmt::BoostingData rows = llmt::boosting_data(data, {});
  const llmt::Progress nobody;
  llmt::Work work(nobody);
  const auto tried = [&](const std::vector<llmt::GrowthRule>& rules) {
    return llmt::try_tree(rows, rows.y.col(0), rows.hold_outs.front(), rules, 1, work).value();
  };
  const llmt::TriedTree by_rd = tried({llmt::GrowthRule::rd});
  EXPECT_LT(rmse(by_rd.residuals), rmse(tried({llmt::GrowthRule::ra}).residuals));
  const llmt::TriedTree best = tried({llmt::GrowthRule::ra, llmt::GrowthRule::rd});
  EXPECT_EQ(best.options.rule, llmt::GrowthRule::rd);
  EXPECT_EQ(best.residuals, by_rd.residuals);
}

// More rows, much noise: boosting stops early, and one smooth tree is at least as good.
TEST(FitBoosted, TriesOneTreeOfManyRowsWhereBoostingStopsEarly) {
  const llmt::BoostResult fitted = llmt::fit_boosted(smooth(5500, 4, 1.0, 8));
  const llmt::BoostSummary& summary = fitted.summaries[0];
  ASSERT_EQ(summary.compared.size(), 9U);  // seven after 50 rounds, and the last two
  EXPECT_EQ(summary.compared[8].name, "one tree");
  EXPECT_LT(summary.compared[8].rmse, summary.compared[7].rmse);
  EXPECT_EQ(summary.variant, "blend");
  EXPECT_NEAR(summary.compared[7].share + summary.compared[8].share, 1.0, 1e-12);
  for (int k = 0; k < 7; ++k) EXPECT_EQ(summary.compared[k].share, 0.0);
}

TEST(FitBoosted, TakesNoTreeWhereTheTruthHasSteps) {
  llmt::TrainingData data = smooth(700, 3, 0.0, 7);
  for (Eigen::Index i = 0; i < 700; ++i) {
    double sum = 0.0;
    for (Eigen::Index j = 0; j < 3; ++j) {
      const double scale = std::pow(10.0, static_cast<double>(j));
      sum += std::floor(5.0 * (data.inputs(i, j) - 300.0) / scale) * (j == 1 ? -1.0 : 1.0);
    }
    data.outputs(i, 0) = sum * sum;
  }
  const llmt::BoostSummary summary = llmt::fit_boosted(data).summaries[0];
  EXPECT_EQ(summary.variant, "symmetric");
  ASSERT_GT(summary.compared.size(), 2U);
  EXPECT_EQ(summary.compared.back().name, "one tree");
  EXPECT_EQ(summary.compared.back().share, 0.0);
}

}  // namespace
}  // namespace one_tree_test
