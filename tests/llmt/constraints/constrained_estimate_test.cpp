// Estimates under signs of slopes and ordered splits: no more constrained than they have to be.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "constraints/constrained_leaves.hpp"
#include "llmt/fit.hpp"
#include "oracles/monotone_data.hpp"
#include "oracles/oracles.hpp"

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using llmt::Trend;
using namespace monotone_data;

// A table and the rows of it that a fit would train on.
struct Rows {
  llmt::Table table;
  llmt::TrainingRows training;
  Rows(const MatrixXd& x, const MatrixXd& y, const std::vector<int>& monotone)
      : table{x, y, VectorXd::Ones(x.rows()), std::vector<int>(x.cols(), 0), {}, {}} {
    for (int j = 0; j < x.cols(); ++j) {
      table.regression_inputs.push_back(j);
      table.split_inputs.push_back(j);
    }
    table.slope_signs = table.monotone = monotone;
    std::vector<int> all;
    for (int i = 0; i < x.rows(); ++i) {
      all.push_back(i);
    }
    training = llmt::training_rows(table, all);
  }
};

TEST(Monotone, TheMarginAtAJumpIsTheSmallestStepOfTheLeaves) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const MatrixXd x = oracle::uniform(200, 2, seed);
    llmt::FitOptions options;
    options.max_leaves = 4;
    options.significance = 1.0;
    options.folds.count = 0;
    const MatrixXd y = oracle::curved(x, 0.2, seed);
    const llmt::Model fitted = llmt::fit(x, y, options).model;
    llmt::Partition partition = fitted.partitions()[0];
    partition.residual_range.resize(0, 0);  // the step of the leaves, before predictions are held
    const llmt::Model model(fitted.inputs(), fitted.outputs(), fitted.regressors(), {partition});
    double smallest = std::numeric_limits<double>::infinity();
    for (const llmt::Node& node : partition.nodes) {
      if (node.split_input != 0) continue;
      constexpr Eigen::Index steps = 20001;
      MatrixXd left(steps, 2);
      left.col(0).setConstant(node.threshold);
      left.col(1) = VectorXd::LinSpaced(steps, -1.5, 1.5);
      MatrixXd right = left;
      right.col(0).setConstant(std::nextafter(node.threshold, 2.0));
      const VectorXd step = model.predict(right).col(0) - model.predict(left).col(0);
      for (Eigen::Index i = 0; i < steps; ++i) {
        // Only where this split is the one that both points are divided by.
        const MatrixXd both = (MatrixXd(2, 2) << left.row(i), right.row(i)).finished();
        const Eigen::MatrixXi leaves = model.leaf_of(both);
        smallest = leaves(0, 0) != leaves(1, 0) ? std::min(smallest, step(i)) : smallest;
      }
    }
    if (std::isfinite(smallest)) {
      const Rows rows(x, y, {1, 0});
      // Parabolas are bounded by their control points, so the margin may be a little smaller than the smallest step.
      const double margin = llmt::order_margin(partition, rows.training);
      EXPECT_LE(margin, smallest + 1e-9) << seed;
      EXPECT_GE(margin, smallest - 0.05 * y.cwiseAbs().maxCoeff()) << seed;
    }
  }
}

TEST(Monotone, ASplitAgainstTheTrendIsTheBestContinuousOrLevelOne) {
  // A falling step: the best two constants in order are one constant.
  MatrixXd x(200, 1);
  MatrixXd y(200, 1);
  for (Eigen::Index i = 0; i < 200; ++i) {
    x(i, 0) = static_cast<double>(i) / 200.0;
    y(i, 0) = (i < 100 ? 3.0 : 1.0) + 0.01 * static_cast<double>(i % 3);
  }
  llmt::FitOptions options;
  options.max_leaves = 4;
  options.significance = 1.0;
  options.folds.count = 0;
  options.trends = {Trend::rising};
  const llmt::Model model = llmt::fit(x, y, options).model;
  EXPECT_GT(model.partitions()[0].num_leaves(), 1);
  for (const llmt::Node& node : model.partitions()[0].nodes) {
    EXPECT_EQ(node.slope(0, 0), 0.0);
  }
  EXPECT_LE((model.predict(x).array() - y.mean()).abs().maxCoeff(), 1e-4);
}

TEST(SlopeSigns, AgainstTheTrendAreExactlyZeroInEveryNode) {
  const MatrixXd x = oracle::uniform(300, 2, 5);
  const MatrixXd y = -3.0 * x.col(0) + x.col(1).cwiseAbs();
  for (const Case& each : cases()) {
    llmt::FitOptions options = each.options;
    options.trends = {Trend::rising_slopes, Trend::any};
    const llmt::Model model = llmt::fit(x, y, options).model;
    Eigen::Index zeros = 0;
    for (const llmt::Node& node : model.partitions()[0].nodes) {
      EXPECT_GE(node.slope(0, 0), 0.0) << each.name;
      zeros += node.slope(0, 0) == 0.0 ? 1 : 0;
    }
    EXPECT_GT(zeros, std::ssize(model.partitions()[0].nodes) / 2) << each.name;
    EXPECT_EQ(model.partitions()[0].nodes[0].slope(0, 0), 0.0) << each.name;
  }
}

TEST(SlopeSigns, ThatTheFitHasAnywayLeaveItsBytes) {
  const MatrixXd x = oracle::uniform(300, 2, 6);
  const MatrixXd y = 5.0 * x.col(0) + x.col(0).array().exp().matrix() + x.col(1).cwiseAbs();
  int strict = 0;  // leaves of a joint estimate may have slopes of any sign under a rising sum
  for (const Case& each : cases()) {
    llmt::FitOptions options = each.options;
    const llmt::Model free = llmt::fit(x, y, options).model;
    const std::vector<llmt::Node>& nodes = free.partitions()[0].nodes;
    if (std::ranges::all_of(nodes, [](const llmt::Node& node) { return node.slope(0, 0) > 0.0; })) {
      ++strict;
      options.trends = {Trend::rising_slopes, Trend::any};
      EXPECT_EQ(llmt::to_json(llmt::fit(x, y, options).model), llmt::to_json(free)) << each.name;
    }
  }
  EXPECT_GE(strict, 5);
}

TEST(Monotone, CostsLittleOfWhatNotSplittingTheInputCosts) {
  const MatrixXd x = oracle::uniform(600, 2, 7);
  const MatrixXd query = oracle::uniform(500, 2, 8);
  const auto truth = [](const MatrixXd& at) -> MatrixXd {
    return 3.0 * (4.0 * at.col(0)).array().tanh().matrix() + at.col(1).cwiseAbs2();
  };
  llmt::FitOptions options = cases()[1].options;
  options.expert.widths = {0.25};
  const auto error = [&] { return llmt::rmse(llmt::fit(x, truth(x), options).model.predict(query), truth(query))(0); };
  const double free = error();
  options.trends = {Trend::rising, Trend::any};
  const double constrained = error();
  options.split_inputs = {1};
  const double unsplit = error();
  EXPECT_LT(constrained, 1.1 * free);
  EXPECT_LT(constrained, 0.2 * unsplit);
}

TEST(Monotone, BadOptionsAreRefusedByName) {
  const MatrixXd x = oracle::uniform(50, 2, 9).cwiseAbs().array().ceil();
  const MatrixXd y = oracle::uniform(50, 1, 10);
  const auto message = [&](const llmt::FitOptions& options, const std::vector<int>& categorical = {}) -> std::string {
    try {
      llmt::fit({.inputs = x, .outputs = y, .categorical_inputs = categorical}, options);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  llmt::FitOptions options;
  options.trends = {Trend::rising};
  EXPECT_EQ(message(options), "llmt::fit: trends has 1 entries, there are 2 inputs");
  options.trends = {Trend::falling_slopes, Trend::any};
  EXPECT_EQ(message(options, {0}),
            "llmt::fit: trends[0] must be any: the input is categorical, its values have no order");
  options.sparse = llmt::SparseChoice::always;
  EXPECT_EQ(message(options), "llmt::fit: sparse is always, it must be never with trends");
}

}  // namespace
