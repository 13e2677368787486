#include <gtest/gtest.h>

#include <functional>
#include <set>
#include <vector>

#include "growth/m5/model.hpp"
#include "llmt/compare.hpp"
#include "llmt/fit.hpp"
#include "oracles/oracles.hpp"
#include "oracles/plain_m5.hpp"
#include "oracles/samples.hpp"

namespace {

using oracle::nodes;

using oracle::PlainM5;
using Rows = std::vector<Eigen::Index>;

llmt::FitResult grow_m5(const llmt::TrainingData& data, llmt::FitOptions options = {}) {
  options.rule = llmt::GrowthRule::m5;
  options.folds.count = 0;
  return llmt::fit(data, options);
}

llmt::FitResult grow_m5(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y, const llmt::FitOptions& options = {}) {
  return grow_m5(llmt::TrainingData{x, y}, options);
}

// Number of leaves that were compared.
int expect_same(const PlainM5::Tree& plain, const llmt::Model& model, int index) {
  const llmt::Node& node = model.partitions()[0].nodes[index];
  EXPECT_EQ(node.samples, std::ssize(plain.rows));
  Eigen::VectorXd centres(std::ssize(model.regressors()));
  for (std::size_t k = 0; k < model.regressors().size(); ++k) {
    centres(k) = model.regressors()[k].centre;
  }
  const Eigen::VectorXd slope = node.slope.row(0).transpose();
  EXPECT_NEAR(node.value(0) - slope.dot(centres), plain.smoothed(0), 1e-8);
  EXPECT_LT((slope - plain.smoothed.tail(slope.size())).norm(), 1e-8);
  EXPECT_EQ(node.is_leaf(), plain.children.empty());
  if (node.is_leaf() || plain.children.empty()) return 1;
  EXPECT_EQ(node.split_input, plain.input);
  EXPECT_NEAR(node.threshold, 0.5 * (plain.low + plain.high), 1e-12);
  return expect_same(plain.children[0], model, node.left) + expect_same(plain.children[1], model, node.right);
}

TEST(M5, IsThePlainOneNodeByNode) {
  int leaves = 0;
  for (std::uint64_t seed = 1; seed <= 25; ++seed) {
    SCOPED_TRACE(seed);
    const Eigen::Index rows = 20 + 10 * seed;
    Eigen::MatrixXd x = oracle::uniform(rows, 3, seed);
    x.col(1) = (4.0 * x.col(1)).array().round();  // ties
    const Eigen::VectorXd y =
        oracle::curved(x, seed % 2 == 0 ? 0.1 : 0.4, seed).col(0) + (x.col(0).array() > 0.3).cast<double>().matrix();
    const PlainM5 plain(x, y);
    leaves += expect_same(plain.root(), grow_m5(x, y).model, 0);
  }
  EXPECT_GT(leaves, 100);  // there was something to compare
}

TEST(M5, DropsInputsAsRefittingDoes) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    const Eigen::Index rows = 9 + 4 * seed;
    Eigen::MatrixXd x = oracle::uniform(rows, 6, seed);
    x.col(3) += 0.9 * x.col(0);
    x.col(5).array() += 1e6;
    const Eigen::VectorXd y = x.col(0) - 0.3 * x.col(1) + 0.4 * oracle::uniform(rows, 1, seed + 30).col(0);
    const llmt::FewInputsModel found = llmt::fit_few_inputs(x, y, Eigen::VectorXd::Ones(rows));
    std::vector<int> inputs = {0, 1, 2, 3, 4, 5};
    const auto regressors = [&](const std::vector<int>& chosen) {
      Eigen::MatrixXd result(rows, 1 + std::ssize(chosen));
      result.col(0).setOnes();
      result.rightCols(std::ssize(chosen)) = x(Eigen::all, chosen);
      return result;
    };
    const auto error = [&](const std::vector<int>& chosen) {
      const Eigen::MatrixXd a = regressors(chosen);
      const double squares = (y - a * oracle::least_squares(a, y)).squaredNorm();
      const double n = static_cast<double>(rows);
      const double v = static_cast<double>(a.cols());
      return std::sqrt(squares / n) * (n + 2.0 * v) / (n - v);
    };
    while (!inputs.empty()) {
      std::vector<int> best;
      for (std::size_t k = 0; k < inputs.size(); ++k) {
        std::vector<int> fewer = inputs;
        fewer.erase(fewer.begin() + k);
        best = k == 0 || error(fewer) < error(best) ? fewer : best;
      }
      if (error(best) > error(inputs)) break;
      inputs = best;
    }
    ASSERT_EQ(found.coefficients, 1 + static_cast<int>(inputs.size()));
    const Eigen::MatrixXd a = regressors(inputs);
    const Eigen::VectorXd solution = oracle::least_squares(a, y);
    for (std::size_t k = 0; k < inputs.size(); ++k) {
      EXPECT_NEAR(found.slope(inputs[k]), solution(k + 1), 1e-8);
    }
    EXPECT_LT((found.residuals - (y - a * solution)).norm(), 1e-8);
  }
}

TEST(M5, ThereAreAlwaysMoreRowsThanCoefficients) {
  const Eigen::MatrixXd x = oracle::uniform(5, 8, 1);
  const llmt::FewInputsModel found = llmt::fit_few_inputs(x, oracle::uniform(5, 1, 2).col(0), Eigen::VectorXd::Ones(5));
  EXPECT_LT(found.coefficients, 5);
  EXPECT_EQ(llmt::adjusted_error(2.0, 10.0, 4.0), 2.0 * 18.0 / 6.0);
  EXPECT_EQ(llmt::adjusted_error(2.0, 4.0, 4.0), 20.0);
}

TEST(M5, CollinearAndConstantColumnsGoFirst) {
  llmt::RowMajor x = oracle::uniform(60, 4, 3);
  x.col(1) = 2.0 * x.col(0);
  x.col(2).setConstant(7e5);
  const Eigen::VectorXd y = 3.0 * x.col(0) - x.col(3);
  const llmt::FewInputsModel found = llmt::fit_few_inputs(x, y, Eigen::VectorXd::Ones(60));
  EXPECT_EQ(found.coefficients, 3);
  EXPECT_NEAR(found.slope(0) + 2.0 * found.slope(1), 3.0, 1e-12);
  EXPECT_NEAR(found.slope(3), -1.0, 1e-12);
  EXPECT_LT(found.rms, 1e-12);
}

TEST(M5, SmoothingIsThatOfAComputationByHand) {
  // A step, ten rows at each of -2, -1, 1, 2. Root: slope cov / var = 7.5 / 2.5 = 3, value 5. Leaves of 20 rows: 0 and
  // 10, so (20 x 0 + 15 x 5) / 35 and (20 x 10 + 15 x 5) / 35 at x = 0, slope 15 x 3 / 35.
  Eigen::MatrixXd x(40, 1);
  Eigen::MatrixXd y(40, 1);
  for (Eigen::Index i = 0; i < 40; ++i) {
    x(i, 0) = std::array<double, 4>{-2.0, -1.0, 1.0, 2.0}[i % 4];
    y(i, 0) = x(i, 0) > 0.0 ? 10.0 : 0.0;
  }
  const llmt::FitResult result = grow_m5(x, y);
  ASSERT_EQ(nodes(result).size(), 3U);
  EXPECT_EQ(nodes(result)[0].threshold, 0.0);
  EXPECT_NEAR(nodes(result)[0].value(0), 5.0, 1e-12);
  EXPECT_NEAR(nodes(result)[0].slope(0, 0), 3.0, 1e-12);
  EXPECT_NEAR(nodes(result)[1].value(0), 75.0 / 35.0, 1e-12);
  EXPECT_NEAR(nodes(result)[2].value(0), 275.0 / 35.0, 1e-12);
  EXPECT_NEAR(nodes(result)[1].slope(0, 0), 45.0 / 35.0, 1e-12);
  EXPECT_NEAR(nodes(result)[2].slope(0, 0), 45.0 / 35.0, 1e-12);
}

TEST(M5, AffineDataGiveOneLeaf) {
  const Eigen::MatrixXd x = oracle::uniform(500, 3, 5);
  for (const double scale : {1.0, 1e-9}) {
    const Eigen::MatrixXd y = scale * (2.0 * x.col(0) - x.col(2)).array() + 1e3 * scale;
    const llmt::FitResult result = grow_m5(x, y);
    ASSERT_EQ(nodes(result).size(), 1U);
    EXPECT_EQ(result.summary.partitions[0].stop, llmt::StopReason::pruning);
    EXPECT_LT((nodes(result)[0].slope / scale - Eigen::RowVector3d(2.0, 0.0, -1.0)).norm(), 1e-10);
  }
}

TEST(M5, RootThatCannotBeSplitHasAllInputs) {
  const Eigen::MatrixXd x = oracle::uniform(20, 3, 9);
  const Eigen::MatrixXd y = 3.0 * x.col(0) - 2.0 * x.col(1) + x.col(2);
  llmt::FitOptions options;
  options.rule = llmt::GrowthRule::m5;
  options.min_leaf_samples = 15;
  options.folds.count = 0;
  const llmt::Model model = llmt::fit(x, y, options).model;
  ASSERT_EQ(model.partitions()[0].nodes.size(), 1U);
  EXPECT_LT((model.partitions()[0].nodes[0].slope - Eigen::RowVector3d(3.0, -2.0, 1.0)).norm(), 1e-10);
}

TEST(M5, ConstantOutputsAndFewRowsAreOneLeaf) {
  EXPECT_EQ(nodes(grow_m5(oracle::uniform(50, 2, 6), Eigen::MatrixXd::Constant(50, 1, 3.5))).size(), 1U);
  EXPECT_EQ(nodes(grow_m5(oracle::uniform(3, 2, 7), oracle::uniform(3, 1, 8))).size(), 1U);
  EXPECT_EQ(nodes(grow_m5(oracle::uniform(1, 2, 7), oracle::uniform(1, 1, 8))).size(), 1U);
}

TEST(M5, CategoriesAreCutInTheOrderOfTheirMeans) {
  Eigen::MatrixXd x = oracle::uniform(600, 2, 11);
  x.col(1) = ((x.col(1).array() + 1.0) * 3.0).floor().cwiseMin(5.0);
  Eigen::VectorXd y(600);
  for (Eigen::Index i = 0; i < 600; ++i) {
    y(i) = x(i, 1) == 0.0 || x(i, 1) == 4.0 || x(i, 1) == 5.0 ? 10.0 * x(i, 0) : -20.0;
  }
  const llmt::FitResult result = grow_m5({.inputs = x, .outputs = y, .categorical_inputs = {1}});
  const std::vector<int>& sides = nodes(result)[0].level_side;
  EXPECT_EQ(nodes(result)[0].split_input, 1);
  EXPECT_EQ(sides, (std::vector<int>{1, -1, -1, -1, 1, 1}));
}

TEST(M5, MissingValuesMayTellSomethingAndRowsOfNoWeightDoNot) {
  Eigen::MatrixXd x = oracle::uniform(600, 2, 12);
  Eigen::VectorXd y = x.col(0);
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(600);
  for (Eigen::Index i = 0; i < 600; ++i) {
    if (i % 3 == 0) {
      x(i, 1) = std::nan("");
      y(i) += 20.0;
    } else if (i % 3 == 1) {
      weights(i) = 0.0;
      y(i) = -1e6;
    }
  }
  const llmt::FitResult result = grow_m5({.inputs = x, .outputs = y, .weights = weights});
  EXPECT_EQ(nodes(result)[0].split_input, 1);
  EXPECT_EQ(nodes(result)[0].threshold, std::numeric_limits<double>::max());
  EXPECT_EQ(nodes(result)[0].missing_left, 0.0);
  EXPECT_EQ(result.summary.samples, 400);
  // Missing at random: rows without a value teach no child, but the tree is found and predicts.
  Eigen::MatrixXd gappy = oracle::uniform(900, 2, 13);
  const Eigen::VectorXd z = (gappy.col(0).array() > 0.1).cast<double>() * 5.0 + gappy.col(1).array();
  for (Eigen::Index i = 0; i < 900; i += 10) {
    gappy(i, 0) = std::nan("");
  }
  const llmt::FitResult of_gappy = grow_m5(gappy, z);
  EXPECT_EQ(nodes(of_gappy)[0].split_input, 0);
  EXPECT_NEAR(nodes(of_gappy)[0].threshold, 0.1, 0.02);
  const double error = llmt::rmse(of_gappy.model.predict(gappy), z)(0);
  EXPECT_LT(error, 1.0);  // all of it where the value is missing: 2.5 x sqrt(0.1) = 0.8
}

TEST(M5, RowsWithoutAValueTeachTheChildThatTheyClearlyBelongTo) {
  Eigen::MatrixXd x = oracle::uniform(900, 1, 13);
  Eigen::VectorXd y = (x.col(0).array() > 0.1).cast<double>() * 5.0 + 0.1 * oracle::uniform(900, 1, 14).col(0).array();
  Eigen::Index left = 0;
  for (Eigen::Index i = 0; i < 900; ++i) {
    if (i % 10 == 0) {
      x(i, 0) = std::nan("");
      y(i) -= y(i) > 2.5 ? 5.0 : 0.0;  // all as on the left
    }
    left += !(x(i, 0) > 0.1) ? 1 : 0;
  }
  const llmt::FitResult result = grow_m5(x, y);
  ASSERT_EQ(nodes(result)[0].split_input, 0);
  EXPECT_LT(nodes(result)[0].threshold, 0.2);
  EXPECT_GT(nodes(result)[0].missing_left, 0.9);
  EXPECT_EQ(nodes(result)[1].samples, left);
  EXPECT_EQ(nodes(result)[1].samples + nodes(result)[2].samples, 900);
}

TEST(M5, WeightsMultiplySquaredErrors) {
  // Rows given twice, and given once with the weight 2: the same relative weights, the same sums.
  const Eigen::MatrixXd x = oracle::uniform(200, 2, 14);
  const Eigen::MatrixXd y = oracle::curved(x, 0.2, 14);
  Eigen::MatrixXd twice_x(300, 2);
  Eigen::MatrixXd twice_y(300, 1);
  twice_x << x, x.topRows(100);
  twice_y << y, y.topRows(100);
  llmt::TrainingData once{.inputs = x, .outputs = y, .weights = Eigen::VectorXd::Ones(200)};
  once.weights.head(100).setConstant(2.0);
  llmt::FitOptions plain;
  plain.max_leaves = 2;
  // Not the same n, for weights have mean 1; but the root's model drops nothing and is the same.
  EXPECT_LT((nodes(grow_m5(once, plain))[0].slope - nodes(grow_m5(twice_x, twice_y, plain))[0].slope).norm(), 1e-10);
}

TEST(M5, SharedTreesServeAllOutputs) {
  const Eigen::MatrixXd x = oracle::uniform(800, 3, 15);
  Eigen::MatrixXd y(800, 2);
  y << oracle::curved(x, 0.1, 15), oracle::curved(x.rowwise().reverse(), 0.1, 16);
  llmt::FitOptions options;
  options.shared_partition = true;
  const llmt::FitResult result = grow_m5(x, y, options);
  ASSERT_EQ(result.model.partitions().size(), 1U);
  std::set<int> inputs;
  for (const llmt::Node& node : nodes(result)) {
    inputs.insert(node.split_input);
  }
  EXPECT_TRUE(inputs.contains(0) && inputs.contains(1) && inputs.contains(2));  // what either output bends in
  // Outputs count alike whatever their scale.
  y.col(1) *= 0x1p-40;
  const llmt::FitResult scaled = grow_m5(x, y, options);
  ASSERT_EQ(nodes(scaled).size(), nodes(result).size());
  for (std::size_t i = 0; i < nodes(result).size(); ++i) {
    EXPECT_EQ(nodes(scaled)[i].threshold, nodes(result)[i].threshold);
    EXPECT_LT((0x1p40 * nodes(scaled)[i].slope.row(1) - nodes(result)[i].slope.row(1)).norm(), 1e-10);
  }
}

TEST(M5, SameBytesAtAnyNumberOfThreadsAndSameTreeInAnyOrderOfRows) {
  const Eigen::MatrixXd x = oracle::uniform(8000, 4, 17);
  const Eigen::MatrixXd y = oracle::curved(x, 0.1, 17);
  llmt::FitOptions options;
  options.max_threads = 1;
  const llmt::FitResult one = grow_m5(x, y, options);
  options.max_threads = 4;
  EXPECT_EQ(to_json(one.model), to_json(grow_m5(x, y, options).model));
  const llmt::FitResult reversed = grow_m5(x.colwise().reverse(), y.colwise().reverse());
  ASSERT_EQ(nodes(one).size(), nodes(reversed).size());
  for (std::size_t i = 0; i < nodes(one).size(); ++i) {
    EXPECT_EQ(nodes(one)[i].threshold, nodes(reversed)[i].threshold);
    EXPECT_LT((nodes(one)[i].slope - nodes(reversed)[i].slope).norm(), 1e-9);
  }
}

TEST(M5, FoldsChooseAmongItsPrefixesWithoutChangingItsModels) {
  const Eigen::MatrixXd x = oracle::uniform(600, 3, 18);
  const Eigen::MatrixXd y = oracle::curved(x, 0.3, 18);
  llmt::FitOptions options;
  options.rule = llmt::GrowthRule::m5;
  const llmt::FitResult chosen = llmt::fit(x, y, options);
  const llmt::FitResult all = grow_m5(x, y);
  const llmt::PartitionSummary& summary = chosen.summary.partitions[0];
  EXPECT_EQ(summary.chosen.candidate.validity.kind, llmt::ValidityKind::crisp);
  EXPECT_EQ(summary.grown_leaves, all.summary.partitions[0].leaves);
  ASSERT_LE(nodes(chosen).size(), nodes(all).size());
  EXPECT_GT(nodes(chosen).size(), 1U);
  for (std::size_t i = 0; i < nodes(chosen).size(); ++i) {
    EXPECT_EQ(nodes(chosen)[i].slope, nodes(all)[i].slope);
    EXPECT_EQ(nodes(chosen)[i].value, nodes(all)[i].value);
  }
  EXPECT_FALSE(chosen.intervals.models().empty());
  EXPECT_EQ(to_json(llmt::from_json(to_json(chosen.model))), to_json(chosen.model));
}

TEST(M5, WhatWouldUndoItsModelsIsRefused) {
  const Eigen::MatrixXd x = oracle::uniform(50, 2, 19);
  const Eigen::MatrixXd y = oracle::curved(x);
  const auto message = [&](const std::function<void(llmt::FitOptions&)>& change) -> std::string {
    llmt::FitOptions options;
    options.rule = llmt::GrowthRule::m5;
    change(options);
    try {
      llmt::fit(x, y, options);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(message([](llmt::FitOptions& options) { options.validity = llmt::ValidityChoice::gaussian; }),
            "llmt::fit: validity is gaussian, with rule m5 it must be auto or crisp");
  EXPECT_EQ(message([](llmt::FitOptions& options) {
              options.expert.shrinkages = {0.0, 1.0};
            }),
            "llmt::fit: expert.shrinkages is 1, it must be 0 with rule m5, which prunes and smooths its own local "
            "models");
}

TEST(M5, StandsAmongTheUsualMethods) {
  std::set<std::string> names;
  for (const llmt::Method& method : llmt::usual_methods()) {
    names.insert(method.name);
  }
  EXPECT_TRUE(names.contains("M5', smoothed"));
  EXPECT_TRUE(names.contains("crisp tree, RA"));
}

}  // namespace
