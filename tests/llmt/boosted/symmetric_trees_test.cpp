// Crisp symmetric trees: how they are grown, and how they predict many rows.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "boosted/boosting_data.hpp"
#include "boosted/growing_tree.hpp"
#include "boosted/model/symmetric_table.hpp"
#include "boosted/model/tree_walk.hpp"
#include "boosted/symmetric_grower.hpp"
#include "llmt/boosted/some_rows.hpp"
#include "llmt/boosted_model.hpp"
#include "llmt/random.hpp"

namespace {

using boosted_tests::Rows;
using boosted_tests::some_rows;

// Two programs for one tree: the rows stay in their order, or those of a node are put together.
TEST(SymmetricGrower, GrowsTheTreesOfTheOtherGrower) {
  for (const bool weighted : {false, true}) {
    for (const double missing_share : {0.0, 0.2}) {
      for (const int slopes : {3, 5, 8}) {
        const Rows rows = some_rows(3000, 7, weighted, missing_share, 9);
        llmt::TreeOptions options;
        options.slopes = slopes;
        const Eigen::Index count = 2500;  // the others are held out
        llmt::TreeGrower by_node(rows.binned, count, options, 1);
        llmt::SymmetricGrower in_order(rows.binned, count, options, 2);
        llmt::Random random(5);
        llmt::Random same_random(5);
        const llmt::GrowingTree expected = by_node.grow(rows.y, random);
        const llmt::GrowingTree tree = in_order.grow(rows.y, same_random);
        ASSERT_GT(tree.size(), 60U);
        std::vector<double> splits;
        std::vector<double> expected_splits;
        for (const llmt::GrowingNode& node : tree)
          splits.push_back(node.feature < 0 ? -1.0 : node.feature + 1e-5 * node.cell);
        for (const llmt::GrowingNode& node : expected) {
          expected_splits.push_back(node.feature < 0 ? -1.0 : node.feature + 1e-5 * node.cell);
        }
        std::ranges::sort(splits);
        std::ranges::sort(expected_splits);
        EXPECT_EQ(splits, expected_splits);
        Eigen::VectorXd left = rows.y;
        Eigen::VectorXd expected_left = rows.y;
        in_order.subtract_last(tree, 0.3, left);
        by_node.subtract_last(expected, 0.3, expected_left);
        EXPECT_LT((left - expected_left).cwiseAbs().maxCoeff(), 1e-9);
        for (const int row : rows.all) {
          EXPECT_NEAR(left(row), rows.y(row) - 0.3 * llmt::value_at(tree, rows.binned, row), 1e-12);
        }
        const Eigen::VectorXd other = rows.y.reverse();
        const llmt::GrowingTree again = in_order.estimate(tree, other);
        const llmt::GrowingTree expected_again = by_node.estimate(expected, other);
        for (const int row : rows.all) {
          EXPECT_NEAR(llmt::value_at(again, rows.binned, row), llmt::value_at(expected_again, rows.binned, row), 1e-9);
        }
      }
    }
  }
}

// Of so many rows splits are found on a half, the leaves of a step between two lines are estimated on all.
TEST(SymmetricGrower, FindsTheSplitsOfManyRowsOnAPartOfThem) {
  constexpr Eigen::Index count = 260000;
  llmt::Random random(6);
  Eigen::VectorXd z(count);
  for (double& value : z) value = random.normal();
  llmt::BinnedRows rows;
  rows.weights = Eigen::VectorXd::Ones(count);
  rows.features.push_back(llmt::bin_feature({}, z, rows.weights));
  llmt::TreeOptions options;
  options.depth = 1;
  options.columns = 1.0;
  options.searched = 250000;
  const Eigen::VectorXd y = (z.array() > 0.75).select(3.0 - 2.0 * z.array(), 0.5 * z.array());
  llmt::SymmetricGrower grower(rows, count, options, 1);
  llmt::SymmetricGrower threads(rows, count, options, 2);
  for (int part = 0; part < 3; ++part) {  // the third tree begins again with the first part
    const llmt::GrowingTree tree = grower.grow(y, random);
    ASSERT_EQ(tree.size(), 3U);
    EXPECT_NEAR(rows.features[0].edges[tree[0].cell], 0.75, 1e-3);
    EXPECT_NEAR(tree[tree[0].left].model.slopes[0], 0.5, 1e-3);
    EXPECT_NEAR(tree[tree[0].right].model.slopes[0], -2.0, 1e-3);
    Eigen::VectorXd left = y;
    grower.subtract_last(tree, 1.0, left);
    EXPECT_LT(left.norm() / std::sqrt(static_cast<double>(count)), 0.05);
    Eigen::VectorXd same_left = y;
    threads.subtract_last(threads.grow(y, random), 1.0, same_left);
    EXPECT_EQ(same_left, left);
  }
  // In noise each part has a split of its own.
  for (double& value : z) value = random.normal();
  std::vector<int> cells;
  llmt::SymmetricGrower of_noise(rows, count, options, 1);
  for (int part = 0; part < 3; ++part) cells.push_back(of_noise.grow(z, random).front().cell);
  EXPECT_NE(cells[1], cells[0]);
  EXPECT_EQ(cells[2], cells[0]);
}

// About 20000 of them are held out, and the others are in random order.
TEST(BoostingData, HoldsOutAPartOfManyRows) {
  constexpr Eigen::Index count = 440000;
  llmt::TrainingData data;
  data.inputs = Eigen::VectorXd::LinSpaced(count, 0.0, 1.0);
  data.outputs = data.inputs;
  const llmt::BoostingData rows = llmt::boosting_data(data, {});
  ASSERT_EQ(rows.hold_outs.size(), 1U);
  EXPECT_EQ(rows.hold_outs[0].held_out.size(), 20000U);
  EXPECT_EQ(rows.hold_outs[0].train.size(), 420000U);
  EXPECT_EQ(rows.hold_outs[0].held_out.front(), 420000);
  EXPECT_NEAR(rows.x.topRows(10000).mean(), 0.5, 0.01);
  EXPECT_NEAR(rows.x.bottomRows(20000).mean(), 0.5, 0.01);
  EXPECT_EQ(rows.x, rows.y);
}

constexpr int num_features = 4;

// Some of the splits of the levels from `level` on; returns the number of the split, or of the leaf.
int add_below(llmt::BoostedTree& tree, const std::vector<llmt::BoostedSplit>& levels, std::size_t level, double pruned,
              llmt::Random& random) {
  if (level == levels.size() || (level > 0 && random.uniform() < pruned)) {
    llmt::BoostedLeaf leaf{.constant = random.normal(), .low = -1.0, .high = 1.5};
    for (std::size_t k = 0; k < std::min<std::size_t>(levels.size(), 3); ++k) {
      leaf.features.push_back(static_cast<int>(k));
      leaf.slopes.push_back(random.normal());
      leaf.means.push_back(k == 2 ? 0.5 : 0.0);
    }
    tree.leaves.push_back(leaf);
    return -static_cast<int>(tree.leaves.size());
  }
  const int number = static_cast<int>(tree.splits.size());
  tree.splits.push_back(levels[level]);
  const int left = add_below(tree, levels, level + 1, pruned, random);
  const int right = add_below(tree, levels, level + 1, pruned, random);
  tree.splits[number].left = left;
  tree.splits[number].right = right;
  return number;
}

// Thresholds are among the values of the rows below.
llmt::BoostedTree some_tree(int depth, double pruned, llmt::Random& random) {
  std::vector<llmt::BoostedSplit> levels;
  for (int level = 0; level < depth; ++level) {
    levels.push_back({.feature = static_cast<int>(random.below(num_features)),
                      .threshold = static_cast<double>(random.below(8)) / 4.0 - 1.0,
                      .missing_left = static_cast<double>(random.below(3)) / 2.0});
  }
  llmt::BoostedTree tree;
  add_below(tree, levels, 0, pruned, random);
  return tree;
}

llmt::BoostedModel some_model(std::vector<llmt::BoostedTree> trees) {
  std::vector<llmt::InputColumn> inputs(num_features);
  std::vector<llmt::BoostedFeature> features;
  for (int k = 0; k < num_features; ++k) {
    inputs[k].name = std::string(1, static_cast<char>('a' + k));
    inputs[k].low = -2.0;
    inputs[k].high = 2.0;
    features.push_back({.inputs = {k}});
  }
  llmt::OutputColumn output;
  output.name = "y";
  return {inputs,
          {output},
          std::vector<double>(num_features, 1.0),
          {{.base = 0.5, .rate = 0.25, .features = features, .trees = std::move(trees)}}};
}

TEST(SymmetricTable, IsOfCrispTreesWithOneSplitALevel) {
  llmt::Random random(1);
  llmt::BoostedTree tree = some_tree(3, 0.0, random);
  ASSERT_TRUE(llmt::symmetric_table(tree).has_value());
  EXPECT_EQ(llmt::symmetric_table(tree)->leaves.size(), 8U);
  llmt::BoostedTree soft = tree;
  soft.splits.back().half_width = 0.5;
  EXPECT_FALSE(llmt::symmetric_table(soft).has_value());
  llmt::BoostedTree other = tree;
  other.splits.back().threshold += 0.25;
  EXPECT_FALSE(llmt::symmetric_table(other).has_value());
  other = tree;
  other.splits.back().missing_left = 0.25;
  EXPECT_EQ(std::ranges::count(llmt::symmetric_table(other)->needed, other.splits.back().feature), 1);
  other = tree;
  other.leaves.back().features = {1, 0, 2};
  EXPECT_FALSE(llmt::symmetric_table(other).has_value());
  EXPECT_FALSE(llmt::symmetric_table(some_tree(9, 0.0, random)).has_value());
}

// Few rows are predicted by the splits of the trees, many by tables where a tree has one.
TEST(SymmetricTable, PredictsManyRowsAsTheSplitsPredictOneToTheBit) {
  llmt::Random random(2);
  std::vector<llmt::BoostedTree> trees;
  for (int depth = 0; depth <= 7; ++depth) {
    for (const double pruned : {0.0, 0.2}) trees.push_back(some_tree(depth, pruned, random));
  }
  trees.push_back(some_tree(4, 0.0, random));
  trees.back().splits.front().half_width = 0.5;
  const llmt::BoostedModel model = some_model(trees);
  Eigen::MatrixXd inputs(1000, num_features);
  for (double& value : inputs.reshaped()) {
    value = random.below(10) == 0 ? std::numeric_limits<double>::quiet_NaN()
                                  : static_cast<double>(random.below(16)) / 8.0 - 1.0;
  }
  const Eigen::MatrixXd predicted = model.predict(inputs);
  for (Eigen::Index i = 0; i < inputs.rows(); ++i) EXPECT_EQ(model.predict(inputs.row(i)), predicted.row(i));
}

// Splits of any place and width, and leaves of any features.
llmt::BoostedTree soft_tree(int depth, double pruned, llmt::Random& random) {
  llmt::BoostedTree tree = some_tree(depth, pruned, random);
  tree.smallest_share = random.below(3) == 0 ? 0.0 : 0.1 * random.uniform();
  for (llmt::BoostedSplit& split : tree.splits) {
    if (random.below(4) == 0) split.feature = static_cast<int>(random.below(num_features));
    if (random.below(4) > 0) split.half_width = static_cast<double>(1 + random.below(8)) / 4.0;
  }
  for (llmt::BoostedLeaf& leaf : tree.leaves) {
    if (random.below(4) == 0 && !leaf.features.empty()) leaf.features.front() = num_features - 1;
    if (random.below(4) == 0) leaf.means.clear();
  }
  return tree;
}

TEST(TreeWalk, PredictsManyRowsAsTheSplitsPredictOneToTheBit) {
  llmt::Random random(3);
  Eigen::MatrixXd inputs(300, num_features);  // the last block is not full
  for (double& value : inputs.reshaped()) {
    value = random.below(30) == 0 ? std::numeric_limits<double>::quiet_NaN()
                                  : static_cast<double>(random.below(33)) / 16.0 - 1.0;
  }
  for (int depth = 0; depth <= 7; ++depth) {
    for (const double pruned : {0.0, 0.2}) {
      const llmt::BoostedModel model = some_model({soft_tree(depth, pruned, random), soft_tree(depth, pruned, random)});
      const Eigen::MatrixXd predicted = model.predict(inputs);
      for (Eigen::Index i = 0; i < inputs.rows(); ++i) {
        EXPECT_EQ(model.predict(inputs.row(i)), predicted.row(i)) << depth << " " << i;
      }
    }
  }
}

TEST(TreeWalk, IsOfTreesOfSixteenLevelsAndSixtyFourPlaces) {
  llmt::Random random(4);
  llmt::BoostedTree tree = some_tree(3, 0.0, random);
  EXPECT_FALSE(llmt::walk_of(tree).has_value());
  for (llmt::BoostedSplit& split : tree.splits) split.half_width = 0.5;
  const std::optional<llmt::TreeWalk> walk = llmt::walk_of(tree);
  ASSERT_TRUE(walk.has_value());
  EXPECT_EQ(walk->steps.size(), 7U + 8U + 7U);
  EXPECT_LE(walk->places.size(), 3U);
  for (const int levels : {16, 17}) {
    llmt::BoostedTree chain;
    for (int level = 0; level < levels; ++level) {
      chain.splits.push_back({.threshold = 0.1 * level, .half_width = 0.5, .left = -1 - level, .right = level + 1});
      chain.leaves.push_back({.constant = 1.0});
    }
    chain.splits.back().right = -1 - levels;
    chain.leaves.push_back({.constant = 2.0});
    EXPECT_EQ(llmt::walk_of(chain).has_value(), levels == 16);
  }
  llmt::BoostedTree wide = some_tree(7, 0.0, random);
  for (llmt::BoostedSplit& split : wide.splits) split = {.half_width = 0.5, .left = split.left, .right = split.right};
  for (std::size_t k = 0; k < wide.splits.size(); ++k) wide.splits[k].threshold = static_cast<double>(k % 64);
  EXPECT_TRUE(llmt::walk_of(wide).has_value());
  for (std::size_t k = 0; k < wide.splits.size(); ++k) wide.splits[k].threshold = static_cast<double>(k);
  EXPECT_FALSE(llmt::walk_of(wide).has_value());
}

}  // namespace
