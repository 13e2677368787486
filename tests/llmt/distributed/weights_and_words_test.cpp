// Weights, categories and the tree of the sample, beside repeated rows, fit() in memory, and brute force.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "distributed/block_sums.hpp"
#include "llmt/distributed.hpp"
#include "llmt/fit.hpp"
#include "llmt/intervals.hpp"
#include "llmt/random.hpp"

namespace llmt::distributed {
namespace {

constexpr Eigen::Index rows_of_block = 200;

struct Weighed {
  Eigen::MatrixXd inputs;
  Eigen::VectorXd output;
  Eigen::VectorXd weights;  // empty: none

  Weighed rows(Eigen::Index first, Eigen::Index count) const {
    return {inputs.middleRows(first, count), output.segment(first, count),
            weights.size() == 0 ? weights : Eigen::VectorXd(weights.segment(first, count))};
  }
};

// Two numbers and a category of five levels, of which the middle ones change slopes; noise of standard deviation .1.
Weighed made(Eigen::Index rows, std::uint64_t seed) {
  Random random(seed);
  Weighed table{Eigen::MatrixXd(rows, 3), Eigen::VectorXd(rows), {}};
  constexpr double offsets[] = {3.0, -1.0, 2.0, -2.0, 0.0};
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double a = random.uniform(-1.0, 1.0);
    const double b = random.uniform(-1.0, 1.0);
    const int level = static_cast<int>(random.uniform(0.0, 5.0));
    table.inputs.row(i) << a, b, level;
    table.output(i) = 3.0 * std::abs(a) + (level % 2 == 0 ? b : -b) + offsets[level] + 0.1 * random.normal();
  }
  return table;
}

FitOptions crisp() {
  FitOptions options;
  options.max_leaves = 6;
  options.validity = ValidityChoice::crisp;
  options.intervals = false;
  return options;
}

Options with(Eigen::Index branch_rows, bool weighted, bool has_levels) {
  Options options{branch_rows, branch_rows, rows_of_block, weighted, {}, crisp()};
  if (has_levels) options.levels = {{}, {}, {"v", "w", "x", "y", "z"}};
  return options;
}

// One shard a block of `table`, each of which `change` turns into another shard.
template <class Change>
State run(const Weighed& table, const Options& options, const Change& change) {
  State state = start({"a", "b", "c"}, "y", options);
  while (!state.finished()) {
    Sums all;
    for (Eigen::Index first = 0; first < table.output.size(); first += rows_of_block) {
      const Weighed shard = change(table.rows(first, std::min(rows_of_block, table.output.size() - first)));
      all = merge(std::move(all), sums({shard.inputs, shard.output, first / rows_of_block, shard.weights}, state, 1));
    }
    state = advance(state, std::move(all), {}, 1);
  }
  return state;
}

State run(const Weighed& table, const Options& options) {
  return run(table, options, [](Weighed shard) { return shard; });
}

double rmse_on(const Model& model, const Weighed& table) { return rmse(model.predict(table.inputs), table.output)(0); }

TEST(WeightsBeyondMemory, AWeightOfKIsKTimesTheRow) {
  Weighed table = made(3000, 1);
  // Few different values, so that the bins of both samples are the same.
  table.inputs = (8.0 * table.inputs).array().round() / 8.0;
  Random random(2);
  table.weights.resize(3000);
  for (double& weight : table.weights) weight = std::floor(random.uniform(0.0, 4.0));  // 0 to 3
  const auto repeat = [](const Weighed& shard) {
    std::vector<Eigen::Index> rows;
    for (Eigen::Index i = 0; i < shard.output.size(); ++i)
      rows.insert(rows.end(), static_cast<std::size_t>(shard.weights(i)), i);
    return Weighed{shard.inputs(rows, Eigen::all), shard.output(rows), {}};
  };
  const State weighed = run(table, with(700, true, false));
  Options repeated_options = with(1400, false, false);
  repeated_options.block_rows = 3 * rows_of_block;
  const State repeated = run(table, repeated_options, repeat);
  ASSERT_GE(weighed.counts().top_leaves, 3);
  ASSERT_FALSE(weighed.counts().is_of_sample);
  EXPECT_EQ(weighed.counts().top_leaves, repeated.counts().top_leaves);
  EXPECT_EQ(weighed.counts().rows, (table.weights.array() > 0.0).count());
  const Eigen::MatrixXd one = weighed.model().predict(table.inputs);
  const Eigen::MatrixXd other = repeated.model().predict(table.inputs);
  EXPECT_LE((one - other).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_NEAR(weighed.counts().held_out_rmse, repeated.counts().held_out_rmse, 1e-9);
  // Without the weights it is another model.
  const State plain = run({table.inputs, table.output, {}}, with(700, false, false));
  EXPECT_GT((plain.model().predict(table.inputs) - one).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(WeightsBeyondMemory, OfPrecisionsOnlyTheRatiosMatter) {
  Weighed table = made(2400, 3);
  Random random(4);
  table.weights.resize(2400);
  for (double& weight : table.weights) weight = random.uniform(0.5, 1.5);
  const State one = run(table, with(700, true, false));
  table.weights *= 1024.0;
  const State other = run(table, with(700, true, false));
  ASSERT_GE(one.counts().top_leaves, 3);
  EXPECT_LE((one.model().predict(table.inputs) - other.model().predict(table.inputs)).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(WeightsBeyondMemory, ATableThatFitsBecomesTheModelOfFit) {
  Weighed table = made(600, 5);
  table.weights = Eigen::VectorXd::Constant(600, 2.0);
  table.weights.head(100).setZero();
  TrainingData data{.inputs = table.inputs, .outputs = table.output, .weights = table.weights};
  data.input_names = {"a", "b", "c"};
  data.output_names = {"y"};
  data.levels = {{}, {}, {"v", "w", "x", "y", "z"}};
  const FitResult expected = fit(data, crisp());
  const State state = run(table, with(600, true, true));
  EXPECT_EQ(state.model_json(), to_json(expected.model, expected.intervals));
}

TEST(WordsBeyondMemory, TheTopSplitOnACategoryIsTheBestOfAllSets) {
  // No number helps: the offsets of the levels are all there is.
  Weighed table = made(2000, 6);
  constexpr double offsets[] = {3.0, -1.0, 2.0, -2.0, 0.0};
  Random random(7);
  for (Eigen::Index i = 0; i < 2000; ++i) {
    table.output(i) = offsets[static_cast<int>(table.inputs(i, 2))] + 0.1 * random.normal();
  }
  State state = start({"a", "b", "c"}, "y", with(1900, false, true));
  for (int pass = 0; pass < 2; ++pass) state = advance(state, sums({table.inputs, table.output}, state, 1), {}, 1);
  const TopNode& root = state.data().nodes[0];
  ASSERT_EQ(root.input, 2);
  const auto rss_of = [&](const std::vector<Eigen::Index>& sides) {
    double rss = 0.0;
    for (const Eigen::Index side : {-1, 1}) {
      std::vector<Eigen::Index> rows;
      for (Eigen::Index i = 0; i < 2000; ++i) {
        if (sides[static_cast<std::size_t>(table.inputs(i, 2))] == side) rows.push_back(i);
      }
      Eigen::MatrixXd design(std::ssize(rows), 3);
      design << Eigen::VectorXd::Ones(std::ssize(rows)), table.inputs(rows, std::vector<int>{0, 1});
      const Eigen::VectorXd y = table.output(rows);
      rss += (y - design * design.colPivHouseholderQr().solve(y)).squaredNorm();
    }
    return rss;
  };
  const double found = rss_of(root.level_side);
  for (int set = 1; set < 16; ++set) {  // the last level is always on the right
    std::vector<Eigen::Index> sides(5, 1);
    for (int level = 0; level < 4; ++level) sides[level] = (set >> level & 1) != 0 ? -1 : 1;
    EXPECT_LE(found, rss_of(sides) * (1.0 + 1e-9)) << set;
  }
}

TEST(WordsBeyondMemory, TheErrorIsThatOfTheFitInMemory) {
  const Weighed table = made(6000, 8);
  const Weighed asked = made(3000, 9);
  const State state = run(table, with(1500, false, true));
  ASSERT_GE(state.counts().top_leaves, 4);
  EXPECT_TRUE(std::ranges::any_of(state.data().nodes, [](const TopNode& node) { return !node.level_side.empty(); }));
  TrainingData data{.inputs = table.inputs, .outputs = table.output};
  data.levels = {{}, {}, {"v", "w", "x", "y", "z"}};
  FitOptions options = crisp();
  options.max_leaves = 24;
  const double in_memory = rmse_on(fit(data, options).model, asked);
  EXPECT_LE(rmse_on(state.model(), asked), 1.02 * in_memory);
  EXPECT_EQ(state.model().inputs()[2].levels, data.levels[2]);
  // Through its file, and with a level that is not known.
  const Model read = from_json(state.model_json());
  Eigen::MatrixXd inputs = asked.inputs;
  inputs(0, 2) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(read.predict(inputs), state.model().predict(inputs));
  EXPECT_TRUE(read.predict(inputs).allFinite());
}

TEST(WordsBeyondMemory, ATableOfCategoriesAloneHasTheirMeans) {
  Weighed table = made(2000, 10);
  table.inputs.col(0).setZero();
  table.inputs.col(1).setOnes();
  Options options = with(700, false, true);
  options.levels[0] = {"only"};
  options.levels[1] = {"none", "all"};
  const State state = run(table, options);
  ASSERT_GE(state.counts().top_leaves, 3);
  const Eigen::MatrixXd predicted = state.model().predict(table.inputs);
  for (int level = 0; level < 5; ++level) {
    double sum = 0.0;
    double rows = 0.0;
    Eigen::Index last = 0;
    for (Eigen::Index i = 0; i < 2000; ++i) {
      if (table.inputs(i, 2) != level) continue;
      sum += table.output(i);
      rows += 1.0;
      last = i;
    }
    EXPECT_NEAR(predicted(last, 0), sum / rows, 1e-6) << level;
  }
}

TEST(WeightsBeyondMemory, WhatDoesNotGoIsNamed) {
  const auto says = [](const auto& call, const char* text) {
    try {
      call();
      ADD_FAILURE() << "not refused: " << text;
    } catch (const std::exception& error) {
      EXPECT_NE(std::string(error.what()).find(text), std::string::npos) << error.what();
    }
  };
  Weighed table = made(500, 11);
  const State plain = start({"a", "b", "c"}, "y", with(300, false, false));
  const State weighed = start({"a", "b", "c"}, "y", with(300, true, true));
  const auto sum = [&](const State& state) { return sums({table.inputs, table.output, 0, table.weights}, state, 1); };
  says([&] { sum(weighed); }, "0 weights of 500 rows");
  table.weights = Eigen::VectorXd::Ones(500);
  says([&] { sum(plain); }, "the fit has none");
  table.weights(7) = -1.0;
  says([&] { sum(weighed); }, "row 7: the weight is -1");
  table.weights.setZero();
  says([&] { advance(weighed, sum(weighed)); }, "no rows with a weight above 0");
  table.weights.setOnes();
  table.inputs(9, 2) = 5.0;
  says([&] { sum(weighed); }, "row 9, column \"c\" is 5, it must be the number of a category: there are 5");
  table.inputs(9, 2) = 1.5;
  says([&] { sum(weighed); }, "row 9, column \"c\"");
  Options options = with(300, false, true);
  options.levels.pop_back();
  says([&] { start({"a", "b", "c"}, "y", options); }, "levels has 2 entries");
  options.levels.push_back({"u", "u"});
  says([&] { start({"a", "b", "c"}, "y", options); }, "two categories of input \"c\"");
  options.levels[2].clear();
  for (int level = 0; level < 256; ++level) options.levels[2].push_back(std::to_string(level));
  says([&] { start({"a", "b", "c"}, "y", options); }, "input \"c\" has 256 categories, 255 are possible");
}

TEST(SampleTree, ItsEquationsHaveTheValiditiesOfItsLeaves) {
  constexpr Eigen::Index rows = 17000;  // more than the sample
  Weighed table = made(rows, 12);
  Random random(13);
  table.weights.resize(rows);
  for (double& weight : table.weights) weight = random.uniform(0.0, 2.0);
  Options options = with(8000, true, true);
  options.fit.validity = ValidityChoice::blend;
  options.fit.folds.count = 0;
  State state = start({"a", "b", "c"}, "y", options);
  const auto sum_all = [&] {
    Sums all;
    for (Eigen::Index first = 0; first < rows; first += rows_of_block) {
      const Weighed shard = table.rows(first, rows_of_block);
      all = merge(std::move(all), sums({shard.inputs, shard.output, first / rows_of_block, shard.weights}, state, 1));
    }
    return all;
  };
  while (state.step() != Step::blend) state = advance(state, sum_all(), {}, 1);
  Sums all = sum_all();
  // In another order of merging.
  Sums other;
  for (Eigen::Index last = rows; last > 0; last -= 1000) {
    const Weighed shard = table.rows(last - 1000, 1000);
    const Eigen::Index block = (last - 1000) / rows_of_block;
    other = merge(std::move(other), sums({shard.inputs, shard.output, block, shard.weights}, state, 2));
  }
  EXPECT_EQ(other.to_bytes(), all.to_bytes());
  const JointSums joint = std::move(all.data()->runs.front().sums).total(rows / rows_of_block).joint;
  const StateData& data = state.data();
  const Partition& tree = data.sample->partitions().front();
  ASSERT_EQ(tree.validity.kind, ValidityKind::blend);
  ASSERT_GE(tree.num_leaves(), 3);
  // A leaf that is 1 in a tree that is 0 elsewhere predicts its validity.
  Eigen::MatrixXd validities(rows, tree.num_leaves());
  Eigen::Index leaf = 0;
  for (std::size_t at = 0; at < tree.nodes.size(); ++at) {
    if (!tree.nodes[at].is_leaf()) continue;
    Partition one = tree;
    one.residual_range.resize(0, 0);
    one.outer_slope = Eigen::MatrixXd::Zero(1, tree.outer_slope.cols());
    for (Node& node : one.nodes) {
      node.slope.setZero();
      node.value(0) = &node == &one.nodes[at] ? 1.0 : 0.0;
    }
    const Model model(data.sample->inputs(), data.sample->outputs(), data.sample->regressors(), {one});
    validities.col(leaf++) = model.predict(table.inputs, 1);
  }
  const Eigen::VectorXd weights = data.weight_scale * table.weights;
  const Eigen::Index each = 1 + std::ssize(data.sample->regressors());
  const Eigen::VectorXd residuals =
      (table.output - data.sample->predict(table.inputs, 1).col(0)) / data.scale(data.inputs());
  for (Eigen::Index i = 0; i < leaf; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      const double expected = (weights.array() * validities.col(i).array() * validities.col(j).array()).sum();
      EXPECT_NEAR(joint.gram(i * each, j * each), expected, 1e-9 * static_cast<double>(rows));
    }
    EXPECT_NEAR(joint.gram(leaf * each, i * each),
                (weights.array() * validities.col(i).array() * residuals.array()).sum(),
                1e-8 * static_cast<double>(rows));
  }
  EXPECT_NEAR(joint.gram(leaf * each, leaf * each), (weights.array() * residuals.array().square()).sum(),
              1e-8 * static_cast<double>(rows));
}

Weighed noisy(Eigen::Index rows, double noise, std::uint64_t seed) {
  Random random(seed);
  Weighed table{Eigen::MatrixXd(rows, 3), Eigen::VectorXd(rows), {}};
  for (double& value : table.inputs.reshaped()) value = random.uniform(-1.0, 1.0);
  for (Eigen::Index i = 0; i < rows; ++i) {
    table.output(i) = 3.0 * std::sin(3.0 * table.inputs(i, 0)) + table.inputs(i, 1) + noise * random.normal();
  }
  return table;
}

TEST(SampleTree, IsTakenWhereRowsAreFewForBranchesAndLeftWhereTheyAreNot) {
  const Weighed truth = noisy(3000, 0.0, 16);
  Options options = with(3000, false, false);
  options.fit.folds.count = 2;
  options.fit.validity = ValidityChoice::blend;
  const Weighed few = noisy(20000, 3.0, 17);
  const State state = run(few, options);
  EXPECT_TRUE(state.counts().is_of_sample);
  EXPECT_EQ(state.step(), Step::finished);
  TrainingData data{.inputs = few.inputs, .outputs = few.output};
  EXPECT_LE(rmse_on(state.model(), truth), 1.1 * rmse_on(fit(data, options.fit).model, truth));
  Eigen::Index samples = 0;
  for (const Node& node : state.model().partitions()[0].nodes) samples += node.is_leaf() ? node.samples : 0;
  EXPECT_EQ(samples, 20000);
  EXPECT_EQ(from_json(state.model_json()).predict(truth.inputs), state.model().predict(truth.inputs));
  // Six leaves are too few for a function that has hardly any noise.
  const State sharp = run(noisy(20000, 0.01, 18), with(3000, false, false));
  EXPECT_FALSE(sharp.counts().is_of_sample);
  EXPECT_GT(sharp.model().partitions()[0].num_leaves(), 6);
}

}  // namespace
}  // namespace llmt::distributed
