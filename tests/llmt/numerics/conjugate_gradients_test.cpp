// Conjugate gradients against direct solutions.
#include "numerics/conjugate_gradients.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "oracles/oracles.hpp"

namespace {

constexpr Eigen::Index unknowns = 12;

Eigen::MatrixXd positive_definite(std::uint64_t seed) {
  const Eigen::MatrixXd a = oracle::uniform(unknowns + 5, unknowns, seed);
  return a.transpose() * a + 0.1 * Eigen::MatrixXd::Identity(unknowns, unknowns);
}

const auto unconditioned = [](const Eigen::MatrixXd& residual) { return residual; };

TEST(ConjugateGradients, AsManyStepsAsUnknownsSolveEveryColumn) {
  const Eigen::MatrixXd a = positive_definite(1);
  const Eigen::MatrixXd right = oracle::uniform(unknowns, 3, 2);
  const auto multiply = [&](const Eigen::MatrixXd& x) -> Eigen::MatrixXd { return a * x; };
  Eigen::MatrixXd found = oracle::uniform(unknowns, 3, 3);
  llmt::conjugate_gradients(multiply, unconditioned, unknowns, 0.0, right - a * found, found);
  EXPECT_LT((a * found - right).norm(), 1e-8);
}

TEST(ConjugateGradients, ThePreconditionerThatIsTheInverseSolvesInOneStep) {
  const Eigen::MatrixXd a = positive_definite(4);
  const Eigen::LLT<Eigen::MatrixXd> factor(a);
  const Eigen::MatrixXd right = oracle::uniform(unknowns, 2, 5);
  const auto multiply = [&](const Eigen::MatrixXd& x) -> Eigen::MatrixXd { return a * x; };
  const auto inverse = [&](const Eigen::MatrixXd& x) -> Eigen::MatrixXd { return factor.solve(x); };
  Eigen::MatrixXd found = Eigen::MatrixXd::Zero(unknowns, 2);
  llmt::conjugate_gradients(multiply, inverse, 1, 0.0, right, found);
  EXPECT_LT((found - factor.solve(right)).norm(), 1e-12 * found.norm());
}

// In the norm of the matrix, in which every step comes nearer to the solution.
TEST(ConjugateGradients, EveryStepComesNearerAndEnoughEndsThem) {
  const Eigen::MatrixXd a = positive_definite(6);
  const Eigen::MatrixXd right = oracle::uniform(unknowns, 1, 7);
  const Eigen::MatrixXd exact = a.llt().solve(right);
  int products = 0;
  const auto multiply = [&](const Eigen::MatrixXd& x) -> Eigen::MatrixXd {
    ++products;
    return a * x;
  };
  double before = (exact.transpose() * a * exact)(0, 0);
  for (int steps = 1; steps <= unknowns / 2; ++steps) {
    Eigen::MatrixXd found = Eigen::MatrixXd::Zero(unknowns, 1);
    llmt::conjugate_gradients(multiply, unconditioned, steps, 0.0, right, found);
    const double now = ((exact - found).transpose() * a * (exact - found))(0, 0);
    EXPECT_LT(now, before) << steps;
    before = now;
  }
  products = 0;
  Eigen::MatrixXd found = Eigen::MatrixXd::Zero(unknowns, 1);
  llmt::conjugate_gradients(multiply, unconditioned, 1000, 1e-4, right, found);
  EXPECT_LT(products, unknowns);
  EXPECT_LE((right - a * found).squaredNorm(), 1e-4 * right.squaredNorm());
}

TEST(ConjugateGradients, AMatrixThatIsNotPositiveAlongADirectionMovesNothing) {
  const Eigen::MatrixXd right = oracle::uniform(unknowns, 1, 8);
  const auto multiply = [](const Eigen::MatrixXd& x) -> Eigen::MatrixXd { return -x; };
  Eigen::MatrixXd found = Eigen::MatrixXd::Zero(unknowns, 1);
  llmt::conjugate_gradients(multiply, unconditioned, 5, 0.0, right, found);
  EXPECT_EQ(found, Eigen::MatrixXd::Zero(unknowns, 1));
}

}  // namespace
