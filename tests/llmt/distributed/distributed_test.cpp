// A fit by sums over blocks: what the sums are, that nothing depends on who forms them, and how well the model
// predicts.
#include "llmt/distributed.hpp"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>
#include <vector>

#include "distributed/block_sums.hpp"
#include "llmt/fit.hpp"
#include "llmt/intervals.hpp"

namespace llmt::distributed {
namespace {

constexpr Eigen::Index block_rows = 256;

struct Table {
  Eigen::MatrixXd inputs;
  Eigen::VectorXd output;
};

// Friedman's function (1991) of three of its inputs, and one that counts nothing; noise of standard deviation `noise`.
Table friedman(Eigen::Index rows, double noise, unsigned seed) {
  std::mt19937 random(seed);
  const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
  Table table{Eigen::MatrixXd(rows, 4), Eigen::VectorXd(rows)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (Eigen::Index j = 0; j < 4; ++j) table.inputs(i, j) = uniform();
    double normal = -6.0;
    for (int k = 0; k < 12; ++k) normal += uniform();
    table.output(i) = 10.0 * std::sin(3.14159265 * table.inputs(i, 0) * table.inputs(i, 1)) +
                      20.0 * std::pow(table.inputs(i, 2) - 0.5, 2) + noise * normal;
  }
  return table;
}

// Block `first` ... `last` - 1 of a table.
Sums sums_of(const Table& table, const State& state, Eigen::Index first, Eigen::Index last, int threads = 1) {
  const Eigen::Index begin = std::min(table.output.size(), first * block_rows);
  const Eigen::Index count = std::min(table.output.size(), last * block_rows) - begin;
  return sums({table.inputs.middleRows(begin, count), table.output.segment(begin, count), first}, state, threads);
}

Eigen::Index blocks_of(const Table& table) { return (table.output.size() + block_rows - 1) / block_rows; }

State begin(Eigen::Index branch_rows, FitOptions fit = {}) {
  fit.max_threads = 0;
  return start({"a", "b", "c", "d"}, "y", {branch_rows, branch_rows, block_rows, false, {}, fit});
}

State pass(const Table& table, const State& state) {
  return advance(state, sums_of(table, state, 0, blocks_of(table)), {}, 1);
}

State run(const Table& table, State state) {
  while (!state.finished()) state = pass(table, state);
  return state;
}

double rmse_of(const Model& model, const Table& table) { return rmse(model.predict(table.inputs), table.output)(0); }

FitOptions quick() {
  FitOptions options;
  options.max_leaves = 6;
  options.validity = ValidityChoice::crisp;
  return options;
}

TEST(DistributedTest, SumsOfBinsEqualBruteForce) {
  const Table table = friedman(1500, 0.1, 1);
  State state = begin(200, quick());
  state = pass(table, state);
  state = pass(table, state);  // the children of the root are open
  const StateData& data = state.data();
  ASSERT_EQ(data.step, Step::grow);
  Sums all = sums_of(table, state, 0, blocks_of(table));
  const BlockSum total = std::move(all.data()->runs.front().sums).total(blocks_of(table));
  const GramShape shape = data.shape();
  const std::vector<Eigen::Index> first = first_bins(data);
  const TopNode& root = data.nodes[0];
  Eigen::Index compared = 0;
  for (const auto& [node, sum] : total.nodes) {
    for (Eigen::Index j = 0; j < 4; ++j) {
      for (Eigen::Index bin = 0; bin < bins_of(data, j); ++bin) {
        Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(6, 6);
        Eigen::Index rows = 0;
        for (Eigen::Index i = 0; i < table.output.size(); ++i) {
          const Eigen::VectorXd x = table.inputs.row(i).transpose();
          if ((x(root.input) <= root.threshold ? root.left : root.right) != node) continue;
          const std::vector<double>& edges = data.edges[j];
          if (bin > 0 && x(j) <= edges[bin - 1]) continue;
          if (bin < std::ssize(edges) && x(j) > edges[bin]) continue;
          Eigen::VectorXd features(6);
          features << 1.0, (x - data.mean.head(4)).cwiseQuotient(data.scale.head(4)), 0.0;
          const double y = (table.output(i) - data.mean(4)) / data.scale(4);
          features(5) = y - data.nodes[node].base.dot(features.head(5));
          expected += features * features.transpose();
          ++rows;
        }
        ASSERT_EQ(sum.counts[first[j] + bin], rows);
        const double* const gram = sum.grams.data() + (first[j] + bin) * shape.size();
        for (Eigen::Index a = 0; a < 6; ++a) {
          for (Eigen::Index b = 0; b <= a; ++b) {
            ASSERT_NEAR(gram[shape.at(a, b)], expected(a, b), 1e-11 * (1.0 + static_cast<double>(rows)));
            ++compared;
          }
        }
      }
    }
  }
  EXPECT_GT(compared, 2 * 4 * 60 * 21 - 1);
}

TEST(DistributedTest, TheTopSplitIsTheBestEdgeBetweenBins) {
  const Table table = friedman(1500, 0.1, 2);
  State state = pass(table, begin(200, quick()));
  state = pass(table, state);
  const StateData& data = state.data();
  const TopNode& root = data.nodes[0];
  const auto rss_of = [&](Eigen::Index input, double threshold, Eigen::Index& smaller) {
    double sum = 0.0;
    smaller = table.output.size();
    for (const bool is_left : {true, false}) {
      std::vector<Eigen::Index> rows;
      for (Eigen::Index i = 0; i < table.output.size(); ++i) {
        if ((table.inputs(i, input) <= threshold) == is_left) rows.push_back(i);
      }
      smaller = std::min<Eigen::Index>(smaller, std::ssize(rows));
      if (rows.size() < 10) return std::nan("");
      Eigen::MatrixXd a(rows.size(), 5);
      a << Eigen::VectorXd::Ones(std::ssize(rows)), table.inputs(rows, Eigen::all);
      const Eigen::VectorXd y = table.output(rows);
      sum += (y - a * a.colPivHouseholderQr().solve(y)).squaredNorm();
    }
    return sum;
  };
  Eigen::Index smaller = 0;
  const double found = rss_of(root.input, root.threshold, smaller);
  EXPECT_EQ(data.nodes[root.left].rows, (table.inputs.col(root.input).array() <= root.threshold).count());
  for (Eigen::Index j = 0; j < 4; ++j) {
    for (const double edge : data.edges[j]) {
      const double rss = rss_of(j, edge, smaller);
      if (smaller < table.output.size() / 8) continue;
      EXPECT_GE(rss, found * (1.0 - 1e-9)) << j << " " << edge;
    }
  }
}

TEST(DistributedTest, TheSameBytesForAnyNumberOfWorkersAndEveryOrderOfMerging) {
  const Table table = friedman(3000, 0.1, 3);
  const Eigen::Index blocks = blocks_of(table);
  State state = begin(900, quick());
  std::mt19937 random(7);
  std::vector<Step> steps;
  while (!state.finished()) {
    steps.push_back(state.step());
    const std::string expected = sums_of(table, state, 0, blocks).to_bytes();
    for (const Eigen::Index workers : {2, 4, 7}) {
      std::vector<Sums> parts;
      for (Eigen::Index k = 0; k < workers; ++k) {
        const Sums part = sums_of(table, state, k * blocks / workers, (k + 1) * blocks / workers, 2);
        parts.push_back(Sums::from_bytes(part.to_bytes()));  // as from another process
      }
      parts.emplace_back();  // a worker without rows
      while (parts.size() > 1) {
        std::ranges::shuffle(parts, random);
        Sums last = std::move(parts.back());
        parts.pop_back();
        parts.back() = merge(std::move(parts.back()), std::move(last));
      }
      ASSERT_EQ(parts.front().to_bytes(), expected) << workers;
    }
    // A process without rows sends sums of nothing.
    const State next = advance(state, merge(Sums::from_bytes(Sums().to_bytes()), Sums::from_bytes(expected)), {}, 1);
    // What goes on from a checkpoint, with other threads.
    const State resumed = advance(State::from_bytes(state.to_bytes()), sums_of(table, state, 0, blocks, 2), {}, 2);
    ASSERT_EQ(resumed.to_bytes(), next.to_bytes());
    state = next;
  }
  for (const Step step : {Step::describe, Step::grow, Step::gather}) EXPECT_TRUE(std::ranges::count(steps, step) > 0);
}

TEST(DistributedTest, ATableThatFitsBecomesTheModelOfFit) {
  const Table table = friedman(700, 0.1, 4);
  FitOptions options;
  options.max_leaves = 5;
  const State state = run(table, begin(700, options));
  TrainingData data{table.inputs, table.output};
  data.input_names = {"a", "b", "c", "d"};
  data.output_names = {"y"};
  const FitResult expected = fit(data, options);
  EXPECT_EQ(state.model_json(), to_json(expected.model, expected.intervals));
  EXPECT_EQ(state.counts().passes, 2);
}

TEST(DistributedTest, TheErrorIsWithinOnePerCentOfTheFitInMemory) {
  const Table table = friedman(12000, 0.5, 5);
  const Table asked = friedman(4000, 0.5, 6);
  FitOptions options;
  options.max_leaves = 12;
  options.intervals = false;
  const State state = run(table, begin(3000, options));
  EXPECT_GE(state.counts().branches_done, 4);
  const double in_memory = rmse_of(fit(table.inputs, table.output, options).model, asked);
  EXPECT_LE(rmse_of(state.model(), asked), 1.01 * in_memory);
  EXPECT_NEAR(state.counts().held_out_rmse, rmse_of(state.model(), asked), 0.05 * in_memory);
  // What the file says is what the model predicts.
  EXPECT_EQ(from_json(state.model_json()).predict(asked.inputs), state.model().predict(asked.inputs));
}

TEST(DistributedTest, AffineRowsAreOneLeafOfLeastSquares) {
  Table table = friedman(2600, 0.0, 7);
  std::mt19937 random(1);
  for (Eigen::Index i = 0; i < table.output.size(); ++i) {
    table.output(i) =
        1e6 + table.inputs.row(i).dot(Eigen::RowVector4d(3.0, 1.0, 0.0, -2.0)) + static_cast<double>(random()) * 1e-10;
  }
  table.inputs.col(2).setConstant(4.0);
  const State state = run(table, begin(700, quick()));
  ASSERT_EQ(state.model().partitions()[0].num_leaves(), 1);
  Eigen::MatrixXd a(table.output.size(), 4);
  a << Eigen::VectorXd::Ones(table.output.size()), table.inputs.col(0), table.inputs.col(1), table.inputs.col(3);
  const Eigen::VectorXd expected = a.colPivHouseholderQr().solve(table.output);
  const Node& leaf = state.model().partitions()[0].nodes[0];
  const auto slope_of = [&](int input) {  // of an input that is left out: 0
    const std::vector<Regressor>& all = state.model().regressors();
    const auto found = std::ranges::find(all, input, &Regressor::input);
    return found == all.end() ? 0.0 : leaf.slope(0, found - all.begin());
  };
  EXPECT_NEAR(slope_of(0), expected(1), 1e-8);
  EXPECT_NEAR(slope_of(1), expected(2), 1e-8);
  EXPECT_EQ(slope_of(2), 0.0);
  EXPECT_NEAR(slope_of(3), expected(3), 1e-8);
  EXPECT_EQ(leaf.rank, 4);
  EXPECT_NEAR(state.model().predict(table.inputs)(5, 0), (a.row(5) * expected)(0), 1e-6);
  // What standard errors and leverages are made of.
  const std::vector<Regressor>& regressors = state.model().regressors();
  std::vector<Eigen::Index> varying = {0};
  Eigen::MatrixXd deviations = Eigen::MatrixXd::Ones(table.output.size(), 4);
  for (std::size_t r = 0; r < regressors.size(); ++r) {
    if (regressors[r].input == 2) continue;  // is constant
    deviations.col(std::ssize(varying)) = table.inputs.col(regressors[r].input).array() - regressors[r].centre;
    varying.push_back(1 + static_cast<Eigen::Index>(r));
  }
  ASSERT_EQ(varying.size(), 4U);
  const Eigen::Matrix4d inverse = (deviations.transpose() * deviations).inverse();
  EXPECT_LT((leaf.inverse_gram(varying, varying) - inverse).norm(), 1e-9 * inverse.norm());
}

TEST(DistributedTest, WhatIsMissingOrDoesNotFitIsNamed) {
  const auto message = [](const auto& call) -> std::string {
    try {
      call();
    } catch (const std::exception& error) {
      return error.what();
    }
    return "";
  };
  const auto contains = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
  Table table = friedman(1500, 0.1, 8);
  const State first = begin(400, quick());
  EXPECT_TRUE(
      contains(message([&] { advance(first, merge(sums_of(table, first, 0, 2), sums_of(table, first, 4, 6))); }),
               "blocks 2 to 3 are missing"));
  EXPECT_TRUE(contains(message([&] { merge(sums_of(table, first, 0, 2), sums_of(table, first, 1, 3)); }), "block 1"));
  const State second = pass(table, first);
  EXPECT_TRUE(contains(message([&] { advance(second, sums_of(table, second, 0, 5)); }), "the first pass had 6"));
  EXPECT_TRUE(contains(message([&] { advance(second, sums_of(table, first, 0, 6)); }), "another state"));
  EXPECT_TRUE(
      contains(message([&] { merge(sums_of(table, first, 0, 1), sums_of(table, second, 1, 2)); }), "different"));
  Table changed = table;
  changed.output(3) = std::nan("");
  EXPECT_TRUE(contains(message([&] { pass(changed, first); }), "row 3, column \"y\""));
  changed = table;
  changed.inputs(1400, 2) += 1e-9;
  EXPECT_TRUE(contains(message([&] { pass(changed, second); }), "the table changed"));
  changed = table;
  changed.inputs.row(1).swap(changed.inputs.row(2));
  EXPECT_TRUE(contains(message([&] { pass(changed, second); }), "the table changed"));
  changed = table;
  changed.inputs(300, 1) = std::nan("");
  EXPECT_TRUE(contains(message([&] { pass(changed, first); }), "\"b\" has 1 missing"));
  FitOptions options;
  options.rule = GrowthRule::m5;
  EXPECT_TRUE(contains(message([&] { begin(400, options); }), "rule"));
  options = {};
  options.loss = Loss::tukey;
  EXPECT_TRUE(contains(message([&] { begin(400, options); }), "loss tukey"));
  EXPECT_TRUE(contains(message([&] { start({"a", "a"}, "y"); }), "\"a\""));
}

TEST(DistributedTest, BytesThatHaveChangedAreRefused) {
  const Table table = friedman(1500, 0.1, 9);
  const State state = pass(table, pass(table, begin(400, quick())));
  for (const bool of_state : {true, false}) {
    const std::string bytes = of_state ? state.to_bytes() : sums_of(table, state, 0, 3).to_bytes();
    const auto read = [&](const std::string& text) {
      of_state ? void(State::from_bytes(text)) : void(Sums::from_bytes(text));
    };
    read(bytes);
    for (std::size_t length = 0; length < bytes.size(); length += 1 + bytes.size() / 50) {
      EXPECT_THROW(read(bytes.substr(0, length)), std::runtime_error) << length;
    }
    for (std::size_t at = 0; at < bytes.size(); at += 1 + bytes.size() / 50) {
      std::string changed = bytes;
      changed[at] = static_cast<char>(changed[at] ^ 4);
      EXPECT_THROW(read(changed), std::runtime_error) << at;
    }
    EXPECT_THROW(read(bytes + "x"), std::runtime_error);
    EXPECT_THROW(of_state ? void(Sums::from_bytes(bytes)) : void(State::from_bytes(bytes)), std::runtime_error);
  }
}

}  // namespace
}  // namespace llmt::distributed
