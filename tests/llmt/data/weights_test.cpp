// What weights of rows mean.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <vector>

#include "llmt/random.hpp"
#include "oracles/random_trees.hpp"

namespace {

using namespace random_trees;

// Counts are repeated rows to the byte: fit/counts_test.cpp. Other weights act like them on errors.
TEST(Weights, RatiosAreThoseOfRepeatedRows) {
  const Eigen::MatrixXd x = oracle::firm(oracle::uniform(200, 3, 54));
  const Eigen::MatrixXd y = oracle::curved(x, 0.1);
  const Eigen::MatrixXd query = oracle::uniform(300, 3, 55);
  llmt::Random random(56);
  Eigen::VectorXd weights(200);
  std::vector<Eigen::Index> repeated;
  for (Eigen::Index i = 0; i < 200; ++i) {
    const std::uint64_t count = 1 + random.below(3);
    weights(i) = 0.5 * static_cast<double>(count);
    repeated.insert(repeated.end(), count, i);
  }
  for (const Kind& kind : {kinds[0], kinds[1], kinds[4]}) {
    llmt::FitOptions options = only(kind, llmt::Estimation::joint, 8);
    options.min_leaf_samples = 1;  // it counts rows, whatever their weight
    const llmt::Model expected = llmt::fit(x(repeated, Eigen::all), y(repeated, Eigen::all), options).model;
    llmt::TrainingData data{.inputs = x, .outputs = y, .weights = weights};
    const llmt::Model found = llmt::fit(data, options).model;
    ASSERT_EQ(found.partitions()[0].num_leaves(), 8);
    for (std::size_t i = 0; i < found.partitions()[0].nodes.size(); ++i) {
      EXPECT_EQ(found.partitions()[0].nodes[i].split_input, expected.partitions()[0].nodes[i].split_input);
      EXPECT_NEAR(found.partitions()[0].nodes[i].threshold, expected.partitions()[0].nodes[i].threshold, 1e-9);
    }
    EXPECT_LT((found.predict(query) - expected.predict(query)).cwiseAbs().maxCoeff(), 1e-5);
    data.weights *= 1e3;
    EXPECT_LT((llmt::fit(data, options).model.predict(query) - found.predict(query)).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(Weights, ZeroIsADeletedRow) {
  Eigen::MatrixXd x = oracle::uniform(300, 3, 57);
  Eigen::MatrixXd y = oracle::curved(x, 0.1);
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(300);
  std::vector<Eigen::Index> kept;
  for (Eigen::Index i = 0; i < 300; ++i) {
    x(i, 2) = std::floor(2.0 * x(i, 2) + 2.0);
    if (i % 3 == 0) {
      weights(i) = 0.0;
      x.row(i) << 100.0, -100.0, 7.0;  // neither extents nor categories come from it
      y(i, 0) = 1e6;
    } else {
      kept.push_back(i);
    }
  }
  const Eigen::MatrixXd query = x(kept, Eigen::all);
  for (const Kind& kind : kinds) {
    const llmt::FitOptions options = only(kind, llmt::Estimation::joint, 8);
    const llmt::FitResult expected =
        llmt::fit({.inputs = query, .outputs = y(kept, Eigen::all), .categorical_inputs = {2}}, options);
    const llmt::FitResult found =
        llmt::fit({.inputs = x, .outputs = y, .weights = weights, .categorical_inputs = {2}}, options);
    EXPECT_EQ(found.summary.samples, 200);
    EXPECT_EQ(found.model.inputs()[0].high, expected.model.inputs()[0].high);
    EXPECT_EQ(found.model.inputs()[2].levels, expected.model.inputs()[2].levels);
    EXPECT_EQ(found.model.regressors().size(), expected.model.regressors().size());
    EXPECT_LT((found.model.predict(query) - expected.model.predict(query)).cwiseAbs().maxCoeff(), 1e-9);
  }
}

}  // namespace
