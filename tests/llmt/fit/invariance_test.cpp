// What must not change the tree that is found: order of rows, scale and offset, columns without information, threads.
#include <gtest/gtest.h>

#include "llmt/fit.hpp"
#include "oracles/oracles.hpp"
#include "oracles/samples.hpp"

namespace {

using oracle::as_grown;
using oracle::Sample;

Sample curved_sample() {
  const Eigen::MatrixXd x = oracle::coarse(oracle::uniform(400, 3, 21));
  return {x, oracle::coarse(oracle::curved(x, 0.02))};
}

llmt::Partition grow(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y) {
  return llmt::fit(x, y, as_grown()).model.partitions()[0];
}

// Same splits; thresholds map as t -> scale t + shift of their input, within `tolerance` of the input's unit before.
void expect_same_tree(const llmt::Partition& tree, const llmt::Partition& expected, double tolerance,
                      double scale = 1.0, double shift = 0.0) {
  ASSERT_GT(expected.nodes.size(), 9U);
  ASSERT_EQ(tree.nodes.size(), expected.nodes.size());
  for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
    EXPECT_EQ(tree.nodes[i].split_input, expected.nodes[i].split_input);
    EXPECT_EQ(tree.nodes[i].samples, expected.nodes[i].samples);
    if (!tree.nodes[i].is_leaf()) {
      EXPECT_NEAR((tree.nodes[i].threshold - shift) / scale, expected.nodes[i].threshold, tolerance);
    }
  }
}

TEST(Invariance, OrderOfRows) {
  const Sample d = curved_sample();
  const std::vector<Eigen::Index> order = llmt::Random(3).permutation(400);
  expect_same_tree(grow(d.x(order, Eigen::all), d.y(order, Eigen::all)), grow(d.x, d.y), 1e-9);
}

TEST(Invariance, OutputOfScale1e6AndBelow) {
  const Sample d = curved_sample();
  for (const double scale : {1e-6, 1e-12, 1e-100, 1e9}) {
    expect_same_tree(grow(d.x, scale * d.y), grow(d.x, d.y), 1e-9);
  }
}

TEST(Invariance, OutputWithOffset1e8) {
  const Sample d = curved_sample();
  expect_same_tree(grow(d.x, d.y.array() + 1e8), grow(d.x, d.y), 1e-6);
  // Scaled by a power of two nothing rounds, so nothing may change at all.
  EXPECT_EQ(llmt::fit(d.x, 0x1p30 * d.y).model.predict(d.x), 0x1p30 * llmt::fit(d.x, d.y).model.predict(d.x));
}

TEST(Invariance, InputsWithOffset1e6) {
  const Sample d = curved_sample();
  expect_same_tree(grow(d.x.array() + 1e6, d.y), grow(d.x, d.y), 1e-9, 1.0, 1e6);
}

TEST(Invariance, InputsOfAnyScale) {
  const Sample d = curved_sample();
  for (const double scale : {1e-8, 1e8, 1e-100}) {
    expect_same_tree(grow(scale * d.x, d.y), grow(d.x, d.y), 1e-9, scale);
  }
  Eigen::MatrixXd mixed = d.x;
  mixed.col(0) *= 0x1p40;
  mixed.col(2) *= 0x1p-40;
  const llmt::Partition tree = grow(mixed, d.y);
  const llmt::Partition expected = grow(d.x, d.y);
  ASSERT_EQ(tree.nodes.size(), expected.nodes.size());
  for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
    EXPECT_EQ(tree.nodes[i].split_input, expected.nodes[i].split_input);
    EXPECT_EQ(tree.nodes[i].samples, expected.nodes[i].samples);
  }
}

TEST(Invariance, DuplicatedAndConstantColumns) {
  const Sample d = curved_sample();
  Eigen::MatrixXd wider(400, 6);
  wider << d.x, Eigen::VectorXd::Constant(400, 1e6), d.x.col(0), d.x.col(1) * 3.0;
  expect_same_tree(grow(wider, d.y),
                   // The default leaf size depends on the number of inputs: ask for the one that the wider table gets.
                   llmt::fit(d.x, d.y, as_grown({.min_leaf_samples = 14})).model.partitions()[0], 1e-9);
}

TEST(Invariance, AffineFunctionAddedToTheOutput) {
  const Sample d = curved_sample();
  const Eigen::MatrixXd affine = d.x * Eigen::Vector3d(3.0, -2.0, 10.0);
  expect_same_tree(grow(d.x, d.y + oracle::coarse(affine)), grow(d.x, d.y), 1e-6);
}

TEST(Invariance, SameBytesAtAnyNumberOfThreads) {
  const Sample d = curved_sample();
  Eigen::MatrixXd y(400, 2);
  y << d.y, oracle::curved(d.x, 0.1, 5);
  for (const bool shared : {false, true}) {
    std::vector<std::string> models;
    std::vector<Eigen::MatrixXd> predictions;
    for (const int threads : {1, 2, 8}) {
      const llmt::FitResult result = llmt::fit(d.x, y, {.shared_partition = shared, .max_threads = threads});
      models.push_back(llmt::to_json(result.model));
      predictions.push_back(result.model.predict(d.x, threads));
    }
    EXPECT_EQ(models[0], models[1]);
    EXPECT_EQ(models[0], models[2]);
    EXPECT_EQ(predictions[0], predictions[2]);
  }
}

// More rows than a block of sums over rows has, several times over, in the folds too. Weights are of very different
// sizes, so that the order in which they are added shows.
TEST(Invariance, SameBytesAtAnyNumberOfThreadsWithManyBlocksOfRows) {
  const Eigen::MatrixXd x = oracle::uniform(15000, 3, 7);
  const Eigen::MatrixXd y = oracle::curved(x, 0.1, 7);
  const Eigen::VectorXd weights = (5.0 * oracle::uniform(15000, 1, 8)).array().exp();
  for (const llmt::ValidityChoice validity : {llmt::ValidityChoice::crisp, llmt::ValidityChoice::blend}) {
    const auto model_on = [&](int threads) {
      llmt::FitOptions options{.max_leaves = 8, .validity = validity, .max_threads = threads};
      options.folds.count = 2;
      return llmt::to_json(llmt::fit({.inputs = x, .outputs = y, .weights = weights}, options).model);
    };
    const std::string one = model_on(1);
    EXPECT_EQ(model_on(2), one);
    EXPECT_EQ(model_on(4), one);
  }
}

}  // namespace
