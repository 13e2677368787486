// What the first pass finds out about a table, beside sums over its rows, and a category whose last level is rare.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "base/sums.hpp"
#include "distributed/block_sums.hpp"
#include "llmt/distributed.hpp"
#include "llmt/random.hpp"
#include "oracles/thrown.hpp"

namespace llmt::distributed {
namespace {

TEST(DistributedDescription, IsOfTheRowsWhoseWeightIsNotZero) {
  constexpr Eigen::Index rows = 600;
  Random random(1);
  Eigen::MatrixXd table(rows, 3);  // two inputs and the output
  Eigen::VectorXd weights(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    table.row(i) << random.uniform(-1.0, 1.0), random.uniform(100.0, 300.0), random.normal();
    weights(i) = i % 5 == 0 ? 0.0 : i % 7 == 0 ? 0.05 : random.uniform(0.5, 2.0);
    if (i % 5 == 0) table.row(i).array() += 1e4;  // takes no part
  }
  table(5, 0) = std::numeric_limits<double>::quiet_NaN();
  State state = start({"a", "b"}, "y", {.branch_rows = 200, .sample_rows = 200, .block_rows = rows, .weighted = true});
  state = advance(state, sums({table.leftCols(2), table.col(2), 0, weights}, state, 1), {}, 1);
  const StateData& data = state.data();
  EXPECT_EQ(data.rows, (weights.array() > 0.0).count());
  for (Eigen::Index column = 0; column < 3; ++column) {
    double sum = 0.0;
    Extent range;
    for (Eigen::Index i = 0; i < rows; ++i) {
      if (weights(i) == 0.0) continue;
      sum += weights(i) * table(i, column);
      range.widen(table(i, column));
    }
    const double mean = sum / weights.sum();
    double squares = 0.0;
    for (Eigen::Index i = 0; i < rows; ++i) {
      if (weights(i) > 0.0) squares += weights(i) * std::pow(table(i, column) - mean, 2);
    }
    EXPECT_NEAR(data.mean(column), mean, 1e-12 * std::abs(mean)) << column;
    // Of a sample of 200 rows, which has a standard error of 5 %.
    EXPECT_NEAR(data.scale(column) / std::sqrt(squares / weights.sum()), 1.0, 0.2) << column;
    EXPECT_EQ(data.range[column].low, range.low) << column;
    EXPECT_EQ(data.range[column].high, range.high) << column;
  }
}

TEST(DistributedDescription, ABranchHoldsAsManyRowsAsTheSampleAtLeast) {
  const auto kept = [](Eigen::Index branch_rows, Eigen::Index sample_rows) {
    return start({"a"}, "y", {.branch_rows = branch_rows, .sample_rows = sample_rows}).data().options;
  };
  EXPECT_EQ(kept(100, 300).branch_rows, 300);
  EXPECT_EQ(kept(100, 300).sample_rows, 300);
  EXPECT_EQ(kept(300, 100).branch_rows, 300);
  EXPECT_EQ(kept(300, 100).sample_rows, 100);
}

TEST(DistributedDescription, BlocksAreCountedFromZero) {
  const Eigen::MatrixXd inputs = Eigen::MatrixXd::Ones(4, 1);
  const State state = start({"a"}, "y", {});
  const std::string bytes = sums({inputs, inputs.col(0), 0}, state, 1).to_bytes();
  auto data = from_bytes<SumsData>(unsealed('+', bytes, "f"));
  auto& run = data.runs.front();
  run.first = std::get<0>(BlockSums<BlockSum>::fields(run.sums)).front().first = -1;
  run.last = 0;
  EXPECT_EQ(oracle::thrown<std::runtime_error>([&] { Sums::from_bytes(sealed('+', to_bytes(data)), "f"); }),
            "f: a block does not go with the rest");
}

TEST(DistributedDescription, SaysHowManyValuesAreMissing) {
  Random random(3);
  Eigen::MatrixXd inputs(600, 2);
  for (double& value : inputs.reshaped()) value = random.uniform(-1.0, 1.0);
  for (const Eigen::Index row : {7, 250, 599}) inputs(row, 1) = std::numeric_limits<double>::quiet_NaN();
  const State state = start({"a", "b"}, "y", {.branch_rows = 200, .sample_rows = 200, .block_rows = 200});
  EXPECT_EQ(oracle::thrown<std::runtime_error>([&] {
              advance(state, sums({inputs, inputs.col(0)}, state, 1), {}, 1);
            }),
            "llmt::distributed::advance: input \"b\" has 3 missing values, which is not possible beyond one memory "
            "(600 rows, branch_rows is 200); leave the column or these rows out, or fill them");
}

// Where the input of a split is missing, the sides have the shares of the rows that learned it.
TEST(DistributedTop, SidesOfAMissingValueHaveTheSharesOfTheirRows) {
  constexpr Eigen::Index rows = 4000;
  Random random(4);
  Eigen::MatrixXd inputs(rows, 2);
  Eigen::VectorXd output(rows);
  Eigen::VectorXd weights(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    inputs.row(i) << random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0);
    output(i) = std::exp(2.0 * inputs(i, 0)) + std::abs(inputs(i, 1)) + 0.05 * random.normal();
    weights(i) = random.uniform(0.5, 2.0);
  }
  Options options{.branch_rows = 300, .sample_rows = 300, .block_rows = 500, .weighted = true};
  options.fit.max_leaves = 2;
  options.fit.validity = ValidityChoice::crisp;
  options.fit.intervals = false;
  State state = start({"a", "b"}, "y", options);
  while (!state.finished()) state = advance(state, sums({inputs, output, 0, weights}, state, 1), {}, 1);
  const std::vector<Node>& nodes = state.model().partitions()[0].nodes;
  Eigen::VectorXd reach = Eigen::VectorXd::Zero(std::ssize(nodes));
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (int at = 0;;) {
      reach(at) += weights(i);
      const Node& node = nodes[at];
      if (node.is_leaf()) break;
      at = inputs(i, node.split_input) <= node.threshold ? node.left : node.right;
    }
  }
  int splits_on_the_right = 0;
  for (std::size_t at = 0; at < nodes.size(); ++at) {
    if (nodes[at].is_leaf()) continue;
    EXPECT_NEAR(nodes[at].missing_left, reach(nodes[at].left) / reach(static_cast<Eigen::Index>(at)), 1e-9) << at;
    if (!nodes[nodes[at].right].is_leaf()) ++splits_on_the_right;
  }
  EXPECT_GE(splits_on_the_right, 2);
}

// A sample without the last level of a category: the tree that is made of it knows the level all the same.
TEST(SampleTree, KnowsLevelsThatItsSampleHasNot) {
  constexpr Eigen::Index rows = 20000;
  constexpr Eigen::Index block_rows = 500;
  Random random(2);
  Eigen::MatrixXd inputs(rows, 2);
  Eigen::VectorXd output(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    inputs.row(i) << random.uniform(-1.0, 1.0), i == 777 ? 2.0 : static_cast<double>(i % 2);
    output(i) = 6.0 * inputs(i, 0) * (inputs(i, 1) == 1.0 ? 1.0 : -1.0) + 5.0 * random.normal();
  }
  Options options{.branch_rows = 3000, .sample_rows = 3000, .block_rows = block_rows};
  options.fit.max_leaves = 6;
  options.fit.folds.count = 2;
  options.fit.validity = ValidityChoice::blend;
  options.fit.intervals = false;
  options.levels = {{}, {"left", "right", "rare"}};
  State state = start({"a", "side"}, "y", options);
  while (!state.finished()) {
    Sums all;
    for (Eigen::Index first = 0; first < rows; first += block_rows) {
      all = merge(std::move(all),
                  sums({inputs.middleRows(first, block_rows), output.segment(first, block_rows), first / block_rows},
                       state, 1));
    }
    state = advance(state, std::move(all), {}, 1);
  }
  ASSERT_TRUE(state.counts().is_of_sample);
  bool splits_the_category = false;
  for (const Node& node : state.model().partitions()[0].nodes) {
    if (node.level_side.empty()) continue;
    splits_the_category = true;
    EXPECT_EQ(node.level_side.size(), 3U);
  }
  ASSERT_TRUE(splits_the_category);
  const Model read = from_json(state.model_json());
  EXPECT_EQ(read.predict(inputs.middleRows(770, 10)), state.model().predict(inputs.middleRows(770, 10)));
}

}  // namespace
}  // namespace llmt::distributed
