#include <gtest/gtest.h>

#include <cmath>

#include "llmt/fit.hpp"
#include "oracles/oracles.hpp"
#include "study.hpp"

namespace {

struct Truth {
  const char* name;
  double (*value)(double, double);
};

// Where the truth jumps, smoothing across the jump costs; the crisp tree is a candidate for that.
const Truth truths[] = {
    {"piecewise linear with a jump", [](double a, double b) { return a > 0.1 ? 2.0 + a - b : -a + 0.5 * b; }},
    {"steps", [](double a, double b) { return (a > -0.3 ? 1.0 : 0.0) + (b > 0.2 ? 0.7 : 0.0); }},
    {"jump and curve",
     [](double a, double b) { return std::sin(2.0 * a) + 0.5 * b * b + (a + 0.0 * b > 0.25 ? 0.8 : 0.0); }},
};

TEST(JumpingTruth, DefaultIsNeverMuchWorseThanTheCrispTree) {
  const std::uint64_t seeds = sampled(3, 1);
  for (const Truth& truth : truths) {
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      const Eigen::MatrixXd x = oracle::uniform(800, 2, seed);
      const Eigen::MatrixXd test = oracle::uniform(4000, 2, 1000 + seed);
      llmt::Random random(seed);
      Eigen::VectorXd y(x.rows());
      for (Eigen::Index i = 0; i < x.rows(); ++i) {
        y(i) = truth.value(x(i, 0), x(i, 1)) + 0.1 * random.normal();
      }
      Eigen::VectorXd expected(test.rows());
      for (Eigen::Index i = 0; i < test.rows(); ++i) {
        expected(i) = truth.value(test(i, 0), test(i, 1));
      }
      llmt::FitOptions crisp;
      crisp.validity = llmt::ValidityChoice::crisp;
      const double of_default = llmt::rmse(llmt::fit(x, y).model.predict(test), expected)(0);
      const double of_crisp = llmt::rmse(llmt::fit(x, y, crisp).model.predict(test), expected)(0);
      EXPECT_LE(of_default, 1.02 * of_crisp) << truth.name << ", seed " << seed;
    }
  }
}

// Blends on both sides of a jump, which all splits blended or none would lose. Next to the jump its place is not known
// better than the gap between two rows, so errors are taken a little off it.
TEST(JumpingTruth, BlendKeepsTheJump) {
  const std::uint64_t seeds = sampled(3, 1);
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const Eigen::MatrixXd x = oracle::uniform(1500, 3, seed);
    const Eigen::MatrixXd test = oracle::uniform(4000, 3, 1000 + seed);
    const auto truth = [](const Eigen::MatrixXd& at) {
      return ((at.col(0).array() > 0.2).select(2.0, Eigen::ArrayXd::Zero(at.rows())) +
              (2.0 * at.col(1).array()).sin() * at.col(2).array())
          .matrix()
          .eval();
    };
    llmt::Random random(seed);
    Eigen::VectorXd y = truth(x);
    for (double& value : y) {
      value += 0.1 * random.normal();
    }
    llmt::FitOptions all_blended;
    all_blended.expert.jumps = {llmt::no_jump};
    const llmt::FitResult result = llmt::fit(x, y);
    const auto error = [&](const llmt::Model& model) {
      const Eigen::VectorXd off = ((test.col(0).array() - 0.2).abs() > 0.02).cast<double>();
      return off.cwiseProduct(model.predict(test) - truth(test)).norm();
    };
    EXPECT_LE(error(result.model), 0.6 * error(llmt::fit(x, y, all_blended).model)) << "seed " << seed;
    const llmt::Partition& partition = result.model.partitions()[0];
    EXPECT_EQ(partition.validity.kind, llmt::ValidityKind::blend);
    EXPECT_EQ(partition.nodes[0].split_input, 0);
    EXPECT_NEAR(partition.nodes[0].threshold, 0.2, 0.02);
    EXPECT_EQ(partition.nodes[0].half_width, 0.0);
  }
}

// Curvature, kinks and noise are no jumps of four times the scatter.
TEST(JumpingTruth, SmoothAndKinkedTruthsHaveNoLargeJumps) {
  double crisp_splits = 0.0;
  double splits = 0.0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Eigen::MatrixXd x = oracle::uniform(1000, 3, seed);
    llmt::Random random(seed);
    Eigen::VectorXd y = (3.0 * x.col(0).array()).sin() * x.col(1).array() + (x.col(2).array() - 0.1).abs();
    for (double& value : y) {
      value += 0.1 * random.normal();
    }
    llmt::FitOptions options;
    options.validity = llmt::ValidityChoice::blend;
    options.expert.jumps = {4.0};
    options.max_leaves = 20;
    options.significance = 1.0;
    options.folds.count = 0;
    const llmt::Model model = llmt::fit(x, y, options).model;
    for (const llmt::Node& node : model.partitions()[0].nodes) {
      splits += node.is_leaf() ? 0.0 : 1.0;
      crisp_splits += !node.is_leaf() && node.half_width == 0.0 ? 1.0 : 0.0;
    }
  }
  EXPECT_LE(crisp_splits, 0.05 * splits);
}

// Among many candidates some is a little better on noise; that is not worth leaving the linear model for.
TEST(NoisyTruth, NothingToFindGivesLeastSquares) {
  const int seeds = sampled(20, 10);
  int trees = 0;
  for (std::uint64_t seed = 1; seed <= static_cast<std::uint64_t>(seeds); ++seed) {
    const Eigen::MatrixXd x = oracle::uniform(300, 3, seed);
    llmt::Random random(100 + seed);
    Eigen::VectorXd y = x.col(0) - 0.5 * x.col(1);
    for (double& value : y) {
      value += random.normal();
    }
    trees += llmt::fit(x, y).summary.partitions[0].leaves > 1 ? 1 : 0;
  }
  EXPECT_LE(10 * trees, seeds);
}

}  // namespace
