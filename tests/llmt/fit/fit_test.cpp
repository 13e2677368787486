#include "llmt/fit.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "growth/pruning.hpp"
#include "oracles/oracles.hpp"
#include "oracles/samples.hpp"

namespace {

using oracle::as_grown;

// The crisp tree as it was grown.
// The crisp tree of plain least-squares leaves with the leaf count that cross-validation chooses.
llmt::FitOptions crisp() { return {.validity = llmt::ValidityChoice::crisp, .expert = {.shrinkages = {0.0}}}; }

// Same splits, same rows, same local models to rounding of their normal equations; what only whole trees have - errors
// and the slopes beyond the training extent - aside.
void expect_same_tree(const llmt::Model& model, const llmt::Model& expected) {
  const std::vector<llmt::Node>& nodes = model.partitions()[0].nodes;
  const std::vector<llmt::Node>& expected_nodes = expected.partitions()[0].nodes;
  ASSERT_EQ(nodes.size(), expected_nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    EXPECT_EQ(nodes[i].left, expected_nodes[i].left);
    EXPECT_EQ(nodes[i].split_input, expected_nodes[i].split_input);
    EXPECT_EQ(nodes[i].threshold, expected_nodes[i].threshold);
    EXPECT_EQ(nodes[i].samples, expected_nodes[i].samples);
    EXPECT_EQ(nodes[i].rank, expected_nodes[i].rank);
    EXPECT_LT((nodes[i].value - expected_nodes[i].value).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_LT((nodes[i].slope - expected_nodes[i].slope).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(Fit, OneLeafIsLeastSquares) {
  const Eigen::MatrixXd x = oracle::uniform(80, 4, 1);
  const Eigen::MatrixXd y = oracle::curved(x, 0.2);
  for (const llmt::GrowthRule rule : {llmt::GrowthRule::rd, llmt::GrowthRule::retis}) {
    const llmt::Model model = llmt::fit(x, y, as_grown({.rule = rule, .max_leaves = 1})).model;
    Eigen::MatrixXd regressors(80, 5);
    regressors << Eigen::VectorXd::Ones(80), x;
    const Eigen::VectorXd coefficients = oracle::least_squares(regressors, y);
    const llmt::Leaf leaf = model.leaves(0).at(0);
    EXPECT_NEAR(leaf.intercept(0), coefficients(0), 1e-13);
    EXPECT_LT((leaf.slope.row(0).transpose() - coefficients.tail(4)).cwiseAbs().maxCoeff(), 1e-13);
    EXPECT_LT((model.predict(x) - regressors * coefficients).cwiseAbs().maxCoeff(), 1e-13);
  }
}

TEST(Fit, EveryLeafIsLeastSquaresOfItsRows) {
  const Eigen::MatrixXd x = oracle::firm(oracle::uniform(500, 3, 2));
  const Eigen::MatrixXd y = oracle::curved(x, 0.02);
  const llmt::Model model = llmt::fit(x, y, as_grown()).model;
  const Eigen::MatrixXi leaf_of = model.leaf_of(x);
  const std::vector<llmt::Leaf> leaves = model.leaves(0);
  ASSERT_GT(leaves.size(), 5U);
  for (int k = 0; k < std::ssize(leaves); ++k) {
    std::vector<int> rows;
    for (int i = 0; i < x.rows(); ++i) {
      const bool inside = (x.row(i).transpose().array() > leaves[k].low.array()).all() &&
                          (x.row(i).transpose().array() <= leaves[k].high.array()).all();
      EXPECT_EQ(inside, leaf_of(i, 0) == k);
      if (inside) {
        rows.push_back(i);
      }
    }
    ASSERT_EQ(std::ssize(rows), leaves[k].samples);
    const double expected = static_cast<double>(oracle::rss(x(rows, Eigen::all), y(rows, Eigen::all)));
    EXPECT_NEAR(leaves[k].rmse(0), std::sqrt(expected / static_cast<double>(rows.size())), 1e-12);
    const Eigen::MatrixXd by_leaf =
        (x(rows, Eigen::all) * leaves[k].slope.row(0).transpose()).array() + leaves[k].intercept(0);
    EXPECT_LT((model.predict(x(rows, Eigen::all)) - by_leaf).cwiseAbs().maxCoeff(), 1e-13);
  }
}

TEST(Fit, AffineDataGiveOneLeafWithoutAnyTest) {
  const Eigen::MatrixXd x = oracle::uniform(200, 3, 3);
  const Eigen::MatrixXd y = (x * Eigen::Vector3d(1.0, -2.0, 0.5)).array() + 3.0;
  const llmt::FitResult result = llmt::fit(x, y, as_grown({.significance = llmt::every_split}));
  EXPECT_EQ(result.summary.partitions[0].leaves, 1);
  EXPECT_EQ(result.summary.partitions[0].stop, llmt::StopReason::exact_fit);
  EXPECT_LT((result.model.predict(x * 5.0) - ((x * 5.0 * Eigen::Vector3d(1.0, -2.0, 0.5)).array() + 3.0).matrix())
                .cwiseAbs()
                .maxCoeff(),
            1e-13);
}

TEST(Fit, PiecewiseAffineDataAreFoundExactly) {
  const Eigen::MatrixXd x = oracle::firm(oracle::uniform(300, 2, 4));
  Eigen::MatrixXd y(300, 1);
  for (int i = 0; i < 300; ++i) {
    y(i, 0) = x(i, 0) <= 0.1 ? 100.0 + x(i, 1) : x(i, 1) <= -0.3 ? 4.0 * x(i, 0) : 7.0 - x(i, 0) + 2.0 * x(i, 1);
  }
  const llmt::FitResult result = llmt::fit(x, y, crisp());
  EXPECT_EQ(result.summary.partitions[0].leaves, 3);
  // The outputs reach 101, where neighbouring numbers are 1.4e-14 apart.
  EXPECT_LT(result.summary.partitions[0].train_rmse(0), 1e-13);
}

TEST(Fit, PureNoiseGivesOneLeafAtTheStatedRate) {
  // Bonferroni makes the family-wise error at most 5 %; 200 trials, so more than 20 splits has probability below 1e-3.
  int split = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    llmt::Random random(seed);
    Eigen::MatrixXd y(100, 1);
    for (double& value : y.reshaped()) {
      value = random.normal();
    }
    split += llmt::fit(oracle::uniform(100, 2, seed + 1000), y, as_grown()).summary.partitions[0].leaves > 1 ? 1 : 0;
  }
  EXPECT_LE(split, 20);
}

TEST(Fit, EveryPrefixIsTheTreeGrownToThatManyLeaves) {
  const Eigen::MatrixXd x = oracle::uniform(400, 3, 5);
  const Eigen::MatrixXd y = oracle::curved(x, 0.05);
  const llmt::Model full = llmt::fit(x, y, as_grown()).model;
  for (Eigen::Index leaves = 1; leaves <= full.partitions()[0].num_leaves(); ++leaves) {
    expect_same_tree(full.prefix(leaves), llmt::fit(x, y, as_grown({.max_leaves = leaves})).model);
  }
}

TEST(Fit, LeavesOfAPrefixTellTheirOwnErrors) {
  const Eigen::MatrixXd x = oracle::firm(oracle::uniform(400, 3, 5));
  const Eigen::MatrixXd y = oracle::curved(x, 0.05);
  const llmt::Model full = llmt::fit(x, y, as_grown()).model;
  ASSERT_GT(full.partitions()[0].num_leaves(), 2);
  EXPECT_NEAR(full.prefix(1).leaves(0)[0].rmse(0), llmt::rmse(full.prefix(1).predict(x), y)(0), 1e-12);
}

TEST(Fit, ThresholdLiesWhereTheChildModelsMeet) {
  // |x1 - 0.37| on a grid of 0.1: anywhere in (0.3, 0.4) splits the rows alike, the models meet at 0.37.
  Eigen::MatrixXd x(400, 2);
  Eigen::MatrixXd y(400, 1);
  for (int i = 0; i < 400; ++i) {
    const int column = i % 20;
    const int row = i / 20;
    x.row(i) << 0.1 * column - 1.0, 0.1 * row - 1.0;
    y(i, 0) = std::abs(x(i, 0) - 0.37) + 0.5 * x(i, 1);
  }
  const llmt::Model closest = llmt::fit(x, y, as_grown({.max_leaves = 2})).model;
  EXPECT_NEAR(closest.partitions()[0].nodes[0].threshold, 0.37, 1e-12);
}

TEST(Fit, ThresholdOfAJumpIsInTheMiddleOfItsGap) {
  Eigen::MatrixXd x(40, 1);
  Eigen::MatrixXd y(40, 1);
  for (int i = 0; i < 40; ++i) {
    x(i, 0) = i / 2;
    y(i, 0) = x(i, 0) < 10.0 ? x(i, 0) : 30.0 + 2.0 * x(i, 0);  // meet at -30
  }
  const llmt::Model model = llmt::fit(x, y, as_grown({.max_leaves = 2})).model;
  EXPECT_EQ(model.partitions()[0].nodes[0].threshold, 9.5);
  EXPECT_LT((model.predict(x) - y).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(Fit, DirectionsTheRowsDoNotDetermineKeepTheParentsSlope) {
  // x1 is 0 or 1; where it is 1, x2 is constant: nothing can be said there of the slopes along both.
  Eigen::MatrixXd x = oracle::uniform(200, 3, 6);
  Eigen::MatrixXd y(200, 1);
  for (int i = 0; i < 200; ++i) {
    x(i, 0) = i % 2;
    x(i, 1) = i % 2 == 1 ? 0.5 : x(i, 1);
  }
  x = oracle::firm(x);
  for (int i = 0; i < 200; ++i) {
    y(i, 0) = i % 2 == 1 ? 5.0 - x(i, 2) : x(i, 2) + 3.0 * x(i, 1);
  }
  const llmt::FitResult result = llmt::fit(x, y, as_grown({.split_inputs = {0}}));
  const llmt::Partition& tree = result.model.partitions()[0];
  ASSERT_EQ(tree.num_leaves(), 2);
  EXPECT_EQ(result.summary.partitions[0].rank_deficient_leaves, 2);
  EXPECT_EQ(tree.nodes[0].rank, 4);
  EXPECT_EQ(tree.nodes[1].rank, 3);
  EXPECT_EQ(tree.nodes[2].rank, 2);
  EXPECT_EQ(tree.nodes[1].slope(0, 0), tree.nodes[0].slope(0, 0));
  EXPECT_EQ(tree.nodes[2].slope(0, 0), tree.nodes[0].slope(0, 0));
  EXPECT_EQ(tree.nodes[2].slope(0, 1), tree.nodes[0].slope(0, 1));
  EXPECT_NEAR(tree.nodes[2].slope(0, 2), -1.0, 1e-13);
  EXPECT_LT((result.model.predict(x) - y).cwiseAbs().maxCoeff(), 1e-13);
}

TEST(Fit, FewerRowsThanCoefficientsGiveTheMinimumNormFit) {
  Eigen::MatrixXd x(2, 3);
  x << 0.0, 1.0, 5.0, 1.0, 3.0, 5.0;
  const Eigen::MatrixXd y = Eigen::Vector2d(1.0, 2.0);
  const llmt::Model model = llmt::fit(x, y).model;
  EXPECT_LT((model.predict(x) - y).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_EQ(model.partitions()[0].nodes[0].rank, 2);
  // In scaled inputs both varying columns explain half each; the constant one nothing.
  EXPECT_NEAR(model.partitions()[0].nodes[0].slope(0, 0), 0.5, 1e-14);
  EXPECT_NEAR(model.partitions()[0].nodes[0].slope(0, 1), 0.25, 1e-14);
  EXPECT_EQ(model.partitions()[0].nodes[0].slope(0, 2), 0.0);
}

TEST(Fit, OneRowPredictsItself) {
  const Eigen::MatrixXd x = Eigen::RowVector2d(3.0, 4.0);
  const Eigen::MatrixXd y = Eigen::MatrixXd::Constant(1, 1, 7.0);
  EXPECT_EQ(llmt::fit(x, y).model.predict(x)(0, 0), 7.0);
}

TEST(Fit, SplitAndRegressionInputsAreSeparate) {
  const Eigen::MatrixXd x = oracle::uniform(300, 3, 8);
  const Eigen::MatrixXd y = oracle::curved(x, 0.01);
  const llmt::Model model = llmt::fit(x, y, as_grown({.split_inputs = {1}, .regression_inputs = {0, 2}})).model;
  EXPECT_GT(model.partitions()[0].num_leaves(), 1);
  for (const llmt::Node& node : model.partitions()[0].nodes) {
    EXPECT_EQ(node.slope.cols(), 2);
    EXPECT_TRUE(node.is_leaf() || node.split_input == 1);
  }
  Eigen::MatrixXd moved = x;
  moved.col(1).setZero();
  EXPECT_NE((model.predict(moved) - model.predict(x)).norm(), 0.0);  // through the splits
}

TEST(Fit, OnePartitionPerOutputIsTheSameAsSeparateFits) {
  const Eigen::MatrixXd x = oracle::uniform(300, 2, 9);
  Eigen::MatrixXd y(300, 2);
  y << oracle::curved(x, 0.02), x.col(0).cwiseAbs2();
  for (const llmt::FitOptions& options : {crisp(), llmt::FitOptions{}}) {
    const Eigen::MatrixXd together = llmt::fit(x, y, options).model.predict(x);
    for (int o = 0; o < 2; ++o) {
      EXPECT_EQ(together.col(o), llmt::fit(x, y.col(o), options).model.predict(x).col(0));
    }
  }
}

TEST(Fit, SharedPartitionOfCopiesIsThePartitionOfOne) {
  const Eigen::MatrixXd x = oracle::uniform(300, 2, 10);
  const Eigen::MatrixXd y = oracle::curved(x, 0.02);
  Eigen::MatrixXd copies(300, 3);
  copies << y, 1000.0 * y, -y;
  const llmt::FitOptions growth{.max_leaves = 8, .significance = 1.0, .shared_partition = true};
  const llmt::Model shared = llmt::fit(x, copies, as_grown(growth)).model;
  const llmt::Model single = llmt::fit(x, y, as_grown({.max_leaves = 8, .significance = 1.0})).model;
  ASSERT_EQ(shared.partitions().size(), 1U);
  ASSERT_EQ(shared.partitions()[0].nodes.size(), single.partitions()[0].nodes.size());
  for (std::size_t i = 0; i < single.partitions()[0].nodes.size(); ++i) {
    EXPECT_EQ(shared.partitions()[0].nodes[i].split_input, single.partitions()[0].nodes[i].split_input);
    EXPECT_NEAR(shared.partitions()[0].nodes[i].threshold, single.partitions()[0].nodes[i].threshold, 1e-9);
  }
  EXPECT_LT((shared.predict(x).col(2) + single.predict(x).col(0)).cwiseAbs().maxCoeff(), 1e-12);
}

// Without the F test the residual variance must not rise (G.4); of pure noise some splits raise it.
TEST(Fit, ResidualVarianceDoesNotRiseUnlessEverySplitIsMade) {
  const Eigen::MatrixXd x = oracle::uniform(600, 2, 12);
  const Eigen::MatrixXd y = oracle::uniform(600, 1, 13);
  const llmt::FitResult falling = llmt::fit(x, y, as_grown({.significance = 1.0}));
  const llmt::FitResult every = llmt::fit(x, y, as_grown({.significance = llmt::every_split}));
  const auto rising_splits = [&](const llmt::Model& model) {
    const std::vector<llmt::Node>& nodes = model.partitions()[0].nodes;
    return std::ranges::count_if(nodes, [&](const llmt::Node& node) {
      if (node.is_leaf()) return false;
      const llmt::Node& left = nodes[node.left];
      const llmt::Node& right = nodes[node.right];
      const auto variance = [](double rss, Eigen::Index freedom) { return rss / static_cast<double>(freedom); };
      return variance(left.rss(0) + right.rss(0), node.samples - left.rank - right.rank) >
             variance(node.rss(0), node.samples - node.rank) * (1.0 + 1e-9);
    });
  };
  EXPECT_EQ(rising_splits(falling.model), 0);
  EXPECT_GT(rising_splits(every.model), 0);
  EXPECT_LT(falling.summary.partitions[0].leaves, every.summary.partitions[0].leaves);
}

TEST(Fit, CrossValidationIsTheHeldOutErrorOfRegrownTrees) {
  const Eigen::MatrixXd x = oracle::uniform(150, 2, 13);
  const Eigen::MatrixXd y = oracle::curved(x, 0.2);
  llmt::FitOptions options = crisp();
  options.significance = 1.0;
  options.max_leaves = 12;
  options.folds = {.count = 4, .kind = llmt::FoldKind::contiguous};
  const llmt::PartitionSummary summary = llmt::fit(x, y, options).summary.partitions[0];
  ASSERT_EQ(summary.crisp_cv_rmse.size(), 12);
  for (Eigen::Index leaves = 1; leaves <= 12; ++leaves) {
    double squared = 0.0;
    for (const llmt::Fold& fold : llmt::make_folds(150, options.folds)) {
      const llmt::Model model = llmt::fit(x(fold.train, Eigen::all), y(fold.train, Eigen::all),
                                          as_grown({.max_leaves = leaves, .significance = 1.0}))
                                    .model;
      squared += (model.predict(x(fold.held_out, Eigen::all)) - y(fold.held_out, Eigen::all)).squaredNorm();
    }
    EXPECT_NEAR(summary.crisp_cv_rmse(leaves - 1), std::sqrt(squared / 150.0), 1e-12);
  }
  Eigen::Index best = 0;
  summary.crisp_cv_rmse.minCoeff(&best);
  EXPECT_EQ(summary.leaves, best + 1);
}

TEST(Fit, RetisPruningFollowsTheMEstimates) {
  const Eigen::MatrixXd x = oracle::uniform(300, 2, 14);
  const Eigen::MatrixXd y = oracle::curved(x, 0.3);
  // RD without its tests makes the splits of RETIS before pruning: both take the smallest sum of squares.
  const auto unpruned = [&](llmt::FitOptions growth) {
    growth.significance = llmt::every_split;
    return llmt::fit(x, y, as_grown(growth)).model;
  };
  const auto pruned_leaves = [](const llmt::Model& model, double m) {
    llmt::Partition partition = model.partitions()[0];
    llmt::prune(partition.nodes, Eigen::VectorXd::Ones(1), m);
    return partition.num_leaves();
  };
  const llmt::Model large = unpruned({.min_leaf_samples = 4});
  const Eigen::Index kept = pruned_leaves(large, 2.0);
  EXPECT_GT(large.partitions()[0].num_leaves(), kept);
  EXPECT_GE(kept, pruned_leaves(large, 50.0));
  const llmt::FitOptions retis = {.rule = llmt::GrowthRule::retis, .min_leaf_samples = 4};
  EXPECT_EQ(llmt::fit(x, y, as_grown(retis)).summary.partitions[0].leaves, kept);

  // One split, by hand: kept exactly if the m-estimate of the parent exceeds that of the children.
  const llmt::Model two = unpruned({.max_leaves = 2});
  std::array<std::vector<int>, 2> rows;
  for (int i = 0; i < 300; ++i) {
    rows[two.leaf_of(x.row(i))(0, 0)].push_back(i);
  }
  const double prior = static_cast<double>(oracle::rss(x, y)) / 300.0;
  for (const double m : {0.5, 2.0, 10.0, 100.0, 1000.0}) {
    double children = 0.0;
    for (const std::vector<int>& of_leaf : rows) {
      const double n = static_cast<double>(of_leaf.size());
      const double rss = static_cast<double>(oracle::rss(x(of_leaf, Eigen::all), y(of_leaf, Eigen::all)));
      children += (n + m / 2.0) / (300.0 + m) * (rss + m * prior) / (n + m);
    }
    const Eigen::Index expected = prior <= children ? 1 : 2;
    EXPECT_EQ(pruned_leaves(two, m), expected) << m;
  }
}

}  // namespace
