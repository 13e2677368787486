#include "pose_selection/exchange.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <limits>

#include "llmt/random.hpp"
#include "llmt/robotics/observability.hpp"
#include "pose_selection/design_bound.hpp"
#include "pose_selection/driving_order.hpp"

namespace llmt::robotics {
namespace {

using Criterion = PoseCriterion;

constexpr Criterion all_criteria[] = {Criterion::position, Criterion::o1, Criterion::o2,
                                      Criterion::o3,       Criterion::o4, Criterion::o5};

Eigen::MatrixXd random_matrix(Eigen::Index rows, Eigen::Index columns, Random& random) {
  Eigen::MatrixXd matrix(rows, columns);
  for (double& value : matrix.reshaped()) value = random.normal();
  return matrix;
}

DesignProblem problem_of(Eigen::Index parameters, Criterion criterion, Random& random) {
  const Eigen::MatrixXd use = random_matrix(3 * parameters, parameters, random);
  return {criterion, 0.01 * Eigen::MatrixXd::Identity(parameters, parameters), use.transpose() * use};
}

Spacing without_spacing(Eigen::Index poses) {
  return {0.0, Eigen::MatrixXd::Zero(poses, 1), {true}, Eigen::MatrixXd(0, 1)};
}

TEST(Exchange, UpdateByAPoseEqualsTheLossComputedAnew) {
  Random random(1);
  const Eigen::MatrixXd rows = random_matrix(3 * 12, 5, random);
  for (const Criterion criterion : all_criteria) {
    const DesignProblem problem = problem_of(5, criterion, random);
    const Eigen::MatrixXd before = problem.given + information(rows, {0, 1, 2});
    const Eigen::VectorXd updated = losses_with(problem, before, rows, std::vector<bool>(12, true));
    for (Eigen::Index pose = 0; pose < 12; ++pose) {
      const double anew = loss(problem, problem.given + information(rows, {0, 1, 2, pose}));
      EXPECT_NEAR(updated(pose), anew, 1e-9 * std::abs(anew)) << static_cast<int>(criterion);
    }
  }
}

// The losses by their definitions: singular values of the stacked rows, a factor of the priors under them.
TEST(Exchange, LossesAreTheIndicesOfTheStackedRows) {
  Random random(2);
  const Eigen::MatrixXd rows = random_matrix(3 * 4, 5, random);
  Eigen::MatrixXd stacked(17, 5);
  stacked << rows, 0.1 * Eigen::MatrixXd::Identity(5, 5);
  const Observability seen = observability(Eigen::JacobiSVD<Eigen::MatrixXd>(stacked).singularValues(), 4);
  const auto loss_of = [&](Criterion criterion) {
    const DesignProblem problem = problem_of(5, criterion, random);
    return loss(problem, problem.given + information(rows, {0, 1, 2, 3}));
  };
  EXPECT_NEAR(loss_of(Criterion::o1), -2.0 * 5.0 * std::log(2.0 * seen.o1), 1e-9);
  EXPECT_NEAR(loss_of(Criterion::o2), -seen.o2, 1e-9);
  EXPECT_NEAR(loss_of(Criterion::o3), -seen.o3, 1e-9);
  EXPECT_NEAR(loss_of(Criterion::o4), -seen.o4, 1e-9);
  EXPECT_NEAR(loss_of(Criterion::o5), 1.0 / seen.o5, 1e-9);
  const DesignProblem problem = problem_of(5, Criterion::position, random);
  const Eigen::MatrixXd sum = problem.given + information(rows, {0, 1, 2, 3});
  EXPECT_NEAR(loss(problem, sum), (sum.inverse() * problem.use).trace(), 1e-9);
}

// All choices of 4 of 10 poses. An exchange of one pose at a time may end in a local minimum, but seldom does, and not
// far from the best.
TEST(Exchange, FindsTheBestSubsetMostly) {
  for (const Criterion criterion : {Criterion::position, Criterion::o1}) {
    int best_found = 0;
    constexpr int trials = 30;
    for (int trial = 0; trial < trials; ++trial) {
      Random random(100 + static_cast<std::uint64_t>(trial));
      const Eigen::MatrixXd rows = random_matrix(3 * 10, 6, random);
      const DesignProblem problem = problem_of(6, criterion, random);
      double best = std::numeric_limits<double>::infinity();
      for (Eigen::Index a = 0; a < 10; ++a) {
        for (Eigen::Index b = a; b < 10; ++b) {
          for (Eigen::Index c = b; c < 10; ++c) {
            for (Eigen::Index d = c; d < 10; ++d) {
              best = std::min(best, loss(problem, problem.given + information(rows, {a, b, c, d})));
            }
          }
        }
      }
      const std::vector<Eigen::Index> chosen = choose_by_exchange(problem, rows, without_spacing(10), {}, 4);
      const double found = loss(problem, problem.given + information(rows, chosen));
      EXPECT_GE(found, best - 1e-9 * std::abs(best));
      EXPECT_LE(found, best + 0.2 * std::abs(best));
      best_found += found <= best + 1e-9 * std::abs(best) ? 1 : 0;
    }
    EXPECT_GE(best_found, 2 * trials / 3) << static_cast<int>(criterion);
  }
}

TEST(Exchange, KeepsTheSpacingAlsoToWhatIsMeasured) {
  Random random(3);
  const Eigen::MatrixXd rows = random_matrix(3 * 30, 4, random);
  Spacing spacing{10.0, Eigen::MatrixXd(30, 1), {true}, Eigen::MatrixXd(1, 1)};
  for (Eigen::Index i = 0; i < 30; ++i) spacing.candidates(i, 0) = 4.0 * static_cast<double>(i);
  spacing.measured(0, 0) = 362.0;  // as 2
  const DesignProblem problem = problem_of(4, Criterion::position, random);
  const std::vector<Eigen::Index> chosen = choose_by_exchange(problem, rows, spacing, {}, 8);
  ASSERT_EQ(chosen.size(), 8U);
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    EXPECT_GE(spacing.candidates(chosen[i], 0), 12.0);
    for (std::size_t k = 0; k < i; ++k) EXPECT_GE(std::abs(chosen[i] - chosen[k]), 3);
  }
  EXPECT_LT(choose_by_exchange(problem, rows, spacing, {}, 20).size(), 20U);  // there is no room for 20
  spacing.turns = {false};                                                    // 362 mm are far from 2 mm
  const std::vector<Eigen::Index> sliding = choose_by_exchange(problem, rows, spacing, {}, 8);
  EXPECT_TRUE(std::ranges::any_of(sliding, [&](Eigen::Index i) { return spacing.candidates(i, 0) < 12.0; }));
}

TEST(DesignBound, NoSubsetIsBetterAndTheIdealIsNear) {
  Random random(4);
  const Eigen::MatrixXd rows = random_matrix(3 * 60, 6, random);
  const DesignProblem problem = problem_of(6, Criterion::position, random);
  const IdealDesign ideal = ideal_design(problem, rows, 12);
  const double bound = variance_bound(ideal, 12, sensitivities(ideal, rows).maxCoeff());
  EXPECT_GT(bound, 0.99 * ideal.variance);
  const std::vector<Eigen::Index> chosen = choose_by_exchange(problem, rows, without_spacing(60), {}, 12);
  const double found = loss(problem, problem.given + information(rows, chosen));
  EXPECT_GE(found, bound);
  EXPECT_LT(found, 1.15 * bound);
  for (int trial = 0; trial < 1000; ++trial) {
    std::vector<Eigen::Index> drawn = random.permutation(60);
    drawn.resize(12);
    ASSERT_GE(loss(problem, problem.given + information(rows, drawn)), bound);
  }
}

TEST(DrivingOrder, VisitsEveryPoseByTheNearest) {
  Eigen::MatrixXd joints(4, 2);
  joints << 0, 0, 30, 1, 10, 0, 21, 9;
  const DrivingOrder order = driving_order(joints);
  EXPECT_EQ(order.poses, (std::vector<Eigen::Index>{0, 2, 3, 1}));
  EXPECT_DOUBLE_EQ(order.travel_deg, 10.0 + 11.0 + 9.0);
}

}  // namespace
}  // namespace llmt::robotics
