// Estimates that start from a sample of the rows.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <numeric>
#include <utility>

#include "data/dataset.hpp"
#include "estimation/joint_estimate.hpp"
#include "estimation/local_estimate.hpp"
#include "estimation/squared_errors.hpp"
#include "growth/best_first/best_first.hpp"
#include "oracles/oracles.hpp"
#include "partition/evaluator.hpp"
#include "partition/tree.hpp"

namespace {

using llmt::Partition;

struct Rows {
  Eigen::MatrixXd inputs;
  Eigen::MatrixXd outputs;
  llmt::Table table{inputs, outputs, Eigen::VectorXd::Ones(inputs.rows()), {0, 0, 0}, {0, 1, 2}, {0, 1, 2}};
};

Rows rows(Eigen::Index count, std::uint64_t seed) {
  Eigen::MatrixXd x = oracle::uniform(count, 3, seed);
  Eigen::MatrixXd y(count, 2);
  y << (2.0 * x.col(0).array()).sin() * x.col(1).array(), x.col(2).cwiseAbs2();
  llmt::Random random(seed);
  for (double& value : y.reshaped()) {
    value += 0.5 * random.normal();
  }
  return {std::move(x), std::move(y)};
}

std::vector<int> all(Eigen::Index count) {
  std::vector<int> result(count);
  std::iota(result.begin(), result.end(), 0);
  return result;
}

// A tree over both outputs, blended.
Partition blended_tree(const llmt::TrainingRows& training) {
  llmt::GrowthProblem problem{&training, {0, 1}, {}, 0};
  problem.options.significance = 1.0;
  problem.options.min_leaf_samples = 10;
  problem.options.max_leaves = 8;
  problem.options.split_inputs = {0, 1, 2};
  Partition partition{
      .outputs = {0, 1}, .validity = {llmt::ValidityKind::blend, 1.0}, .nodes = llmt::grow(problem).nodes};
  llmt::set_half_widths(partition, training.low(), training.high());
  return partition;
}

double distance(const Partition& a, const Partition& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.nodes.size(); ++i) {
    if (a.nodes[i].is_leaf()) {
      sum += (a.nodes[i].value - b.nodes[i].value).squaredNorm() + (a.nodes[i].slope - b.nodes[i].slope).squaredNorm();
    }
  }
  return std::sqrt(sum);
}

// Two steps with a preconditioner from 60 rows for each unknown: each gains a factor of about 1 / sqrt(60 / 4) or more.
TEST(Sample, JointEstimateOnAllRowsIsReachedFromIt) {
  const Rows data = rows(20000, 1);
  const llmt::TrainingRows training = llmt::training_rows(data.table, all(20000));
  const Partition tree = blended_tree(training);
  const llmt::TrainingRows sample = llmt::subsample(training, 60 * 4 * 8);
  const llmt::Regularisation regularisation{1e-6, 0.0};
  const llmt::LeafSums of_all = llmt::sum_leaves(training, tree, 1);
  const Partition exact = llmt::joint(of_all, 8, {regularisation}).front();
  const llmt::LeafSums of_sample = llmt::sum_leaves(sample, tree, 1);
  const double before = distance(llmt::joint(of_sample, 8, {regularisation}).front(), exact);
  llmt::Work uncounted;
  const Partition found = llmt::joint_from_sample(of_sample, training, 8, regularisation, uncounted);
  EXPECT_LE(distance(found, exact), 0.1 * before);
  EXPECT_EQ(found.residual_range, llmt::as_grown(of_all, 8).residual_range);
}

// Weighted sum of squared errors over all rows.
double loss(const Partition& partition, const llmt::TrainingRows& training) {
  const Eigen::VectorXd weights = Eigen::VectorXd::Ones(2);
  const std::vector<llmt::Chunk> chunks = {llmt::fetch(training, all(training.count()), partition.outputs)};
  return llmt::squared_errors(partition, training, chunks, weights).sum();
}

// A few rows far out have a leaf, and next to none of them is in the sample: the sample says nothing of the leaf's
// slopes, and a step made on its word must not go astray.
TEST(Sample, LeafThatItHardlyHoldsDoesNotSpoilTheEstimateOnAllRows) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Rows data = rows(20000, seed);
    for (Eigen::Index row = 0; row < 15; ++row) {
      data.inputs(row, 0) += 40.0;
      data.outputs.row(row).array() += 30.0;
    }
    const Rows far{data.inputs, data.outputs};
    const llmt::TrainingRows training = llmt::training_rows(far.table, all(20000));
    const Partition tree = blended_tree(training);
    const llmt::TrainingRows sample = llmt::subsample(training, 60 * 4 * 8);
    const llmt::Regularisation regularisation{1e-6, 0.0};
    const llmt::LeafSums of_all = llmt::sum_leaves(training, tree, 1);
    const llmt::LeafSums of_sample = llmt::sum_leaves(sample, tree, 1);
    const double exact = loss(llmt::joint(of_all, 8, {regularisation}).front(), training);
    llmt::Work uncounted;
    const double found = loss(llmt::joint_from_sample(of_sample, training, 8, regularisation, uncounted), training);
    EXPECT_LE(found, 1.05 * exact) << "seed " << seed;
  }
}

// Sum of squared errors of the best coefficients that leave the slopes of `partition` which are 0 at 0, and its own.
std::pair<double, double> best_and_own_error(const Rows& data, const llmt::TrainingRows& training,
                                             const Partition& partition) {
  const llmt::Evaluator evaluator(partition, training.columns, 3);
  const Eigen::Index count = training.count();
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(count, 4 * std::ssize(partition.nodes));
  Eigen::MatrixXd predicted(count, 2);
  std::vector<llmt::Activation> active;
  Eigen::Vector3d deviations;
  Eigen::Vector2d values;
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Vector3d row = data.inputs.row(i);
    llmt::deviations_at(training.columns, training.regressors, row.data(), deviations.data());
    evaluator.activate(row.data(), active);
    predicted.row(i).setZero();
    for (const llmt::Activation& entry : active) {  // without guards, as estimates are made
      const llmt::Node& node = partition.nodes[entry.node];
      predicted.row(i) += entry.validity * (node.value + node.slope * deviations).transpose();
      columns(i, 4 * entry.node) = entry.validity;
      for (Eigen::Index k = 0; k < 3; ++k) {
        columns(i, 4 * entry.node + 1 + k) = node.slope.col(k).isZero(0.0) ? 0.0 : entry.validity * deviations(k);
      }
    }
  }
  const Eigen::MatrixXd best = columns * columns.colPivHouseholderQr().solve(data.outputs);
  return {(data.outputs - best).squaredNorm(), (data.outputs - predicted).squaredNorm()};
}

TEST(Sample, SparseEstimateOnAllRowsIsReachedFromItWithItsZeros) {
  const Rows data = rows(4000, 3);
  const llmt::TrainingRows training = llmt::training_rows(data.table, all(4000));
  const llmt::TrainingRows sample = llmt::subsample(training, 30 * 4 * 8);
  const llmt::Regularisation regularisation{1e-8, 0.0, true};
  const llmt::LeafSums of_sample = llmt::sum_leaves(sample, blended_tree(training), 1, true);
  const Partition before = llmt::joint(of_sample, 8, {regularisation}).front();
  llmt::Work uncounted;
  const Partition after = llmt::joint_from_sample(of_sample, training, 8, regularisation, uncounted);
  Eigen::Index zeros = 0;
  for (std::size_t i = 0; i < after.nodes.size(); ++i) {
    if (after.nodes[i].is_leaf()) {
      EXPECT_TRUE(((after.nodes[i].slope.array() == 0.0) == (before.nodes[i].slope.array() == 0.0)).all());
      zeros += (after.nodes[i].slope.array() == 0.0).count();
    }
  }
  EXPECT_GT(zeros, 8);
  const auto [best, error_before] = best_and_own_error(data, training, before);
  const auto [same_best, error_after] = best_and_own_error(data, training, after);
  EXPECT_GT(error_after, best * (1.0 - 1e-9));
  EXPECT_LT(error_after - best, 0.02 * (error_before - best));  // two steps, each about a digit of the coefficients
}

TEST(Sample, DependsOnTheRowsAndNotOnTheirOrder) {
  const Rows data = rows(5000, 2);
  std::vector<int> order = all(5000);
  std::ranges::reverse(order);
  const Eigen::MatrixXd inputs = data.inputs(order, Eigen::all);
  const Eigen::MatrixXd outputs = data.outputs(order, Eigen::all);
  const llmt::Table reversed{inputs, outputs, data.table.weights, {0, 0, 0}, {0, 1, 2}, {0, 1, 2}};
  const llmt::TrainingRows training = llmt::training_rows(data.table, all(5000));
  const llmt::TrainingRows sample = llmt::subsample(training, 1000);
  llmt::TrainingRows other = llmt::subsample(llmt::training_rows(reversed, all(5000)), 1000);
  EXPECT_EQ(sample.count(), 1000);
  EXPECT_NEAR(llmt::total_weight(sample), llmt::total_weight(training), 1e-9 * 5000.0);
  for (int& row : other.rows) {
    row = 4999 - row;
  }
  std::ranges::reverse(other.rows);
  EXPECT_EQ(sample.rows, other.rows);
  // Fewer are among more.
  const llmt::TrainingRows fewer = llmt::subsample(sample, 100);
  EXPECT_EQ(fewer.rows, llmt::subsample(training, 100).rows);
}

}  // namespace
