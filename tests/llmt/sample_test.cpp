// Estimates that start from a sample of the rows.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "growth.hpp"
#include "joint_fit.hpp"
#include "oracles.hpp"
#include "training.hpp"

namespace {

using llmt::Partition;

struct Rows {
  Eigen::MatrixXd inputs;
  Eigen::MatrixXd outputs;
  llmt::Table table{inputs, outputs, Eigen::VectorXd::Ones(inputs.rows()), {0, 0, 0}, {0, 1, 2}, {0, 1, 2}};
};

Rows rows(std::ptrdiff_t count, std::uint64_t seed) {
  Eigen::MatrixXd x = oracle::uniform(count, 3, seed);
  Eigen::MatrixXd y(count, 2);
  y << (2.0 * x.col(0).array()).sin() * x.col(1).array(), x.col(2).cwiseAbs2();
  llmt::Random random(seed);
  for (double& value : y.reshaped()) {
    value += 0.5 * random.normal();
  }
  return {std::move(x), std::move(y)};
}

std::vector<int> all(std::ptrdiff_t count) {
  std::vector<int> result(static_cast<std::size_t>(count));
  std::iota(result.begin(), result.end(), 0);
  return result;
}

/// A tree over both outputs, blended.
Partition blended_tree(const llmt::TrainingRows& training) {
  llmt::GrowthProblem problem{&training, {0, 1}, {}, 0};
  problem.options.significance = 1.0;
  problem.options.min_leaf_samples = 10;
  problem.options.max_leaves = 8;
  problem.options.split_inputs = {0, 1, 2};
  problem.options.shared_partition = true;
  Partition partition{
      .outputs = {0, 1}, .validity = {llmt::ValidityKind::blend, 1.0, 1}, .nodes = llmt::grow(problem).nodes};
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
  const llmt::TrainingRows sample = llmt::thinned(training, 60 * 4 * 8);
  const llmt::Regularisation regularisation{1e-6, 0.0};
  const Partition exact = llmt::JointFit(training, tree, 1).joint(8, {regularisation}).front();
  const llmt::JointFit fit(sample, tree, 1);
  const double before = distance(fit.joint(8, {regularisation}).front(), exact);
  EXPECT_LE(distance(fit.joint_on(training, 8, regularisation), exact), 0.1 * before);
  EXPECT_EQ(fit.joint_on(training, 8, regularisation).residual_range,
            llmt::JointFit(training, tree, 1).as_grown(8).residual_range);
}

TEST(Sample, JointEstimateOfSharedLocalModelsIsReachedFromItToo) {
  const Rows data = rows(20000, 3);
  const llmt::TrainingRows training = llmt::training_rows(data.table, all(20000));
  const Partition tree = blended_tree(training);
  const llmt::TrainingRows sample = llmt::thinned(training, 60 * 4 * 8);
  const llmt::Regularisation regularisation{1e-6, 0.0};
  llmt::JointFit of_all(training, tree, 1);
  llmt::JointFit fit(sample, tree, 1);
  const std::vector<llmt::Merge> merges = of_all.merges();
  for (std::size_t k = 0; k < 3; ++k) {
    of_all.share(merges[k]);
    fit.share(merges[k]);
  }
  const Partition exact = of_all.joint(8, {regularisation}).front();
  const Partition reached = fit.joint_on(training, 8, regularisation);
  EXPECT_EQ(reached.num_local_models(), 5);
  EXPECT_LE(distance(reached, exact), 0.1 * distance(fit.joint(8, {regularisation}).front(), exact));
}

TEST(Sample, DependsOnTheRowsAndNotOnTheirOrder) {
  const Rows data = rows(5000, 2);
  std::vector<int> order = all(5000);
  std::reverse(order.begin(), order.end());
  const Eigen::MatrixXd inputs = data.inputs(order, Eigen::all);
  const Eigen::MatrixXd outputs = data.outputs(order, Eigen::all);
  const llmt::Table reversed{inputs, outputs, data.table.weights, {0, 0, 0}, {0, 1, 2}, {0, 1, 2}};
  const llmt::TrainingRows training = llmt::training_rows(data.table, all(5000));
  const llmt::TrainingRows sample = llmt::thinned(training, 1000);
  llmt::TrainingRows other = llmt::thinned(llmt::training_rows(reversed, all(5000)), 1000);
  EXPECT_EQ(sample.count(), 1000);
  EXPECT_NEAR(llmt::total_weight(sample), llmt::total_weight(training), 1e-9 * 5000.0);
  for (int& row : other.rows) {
    row = 4999 - row;
  }
  std::reverse(other.rows.begin(), other.rows.end());
  EXPECT_EQ(sample.rows, other.rows);
  // Fewer are among more.
  const llmt::TrainingRows fewer = llmt::thinned(sample, 100);
  EXPECT_EQ(fewer.rows, llmt::thinned(training, 100).rows);
}

}  // namespace
