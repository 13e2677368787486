// The optimisation of one oblique split, against brute force.
#include "growth/hilomot/oblique_split.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "model/logistic.hpp"
#include "oracles/oracles.hpp"

namespace {

using llmt::Gate;
using llmt::GateModels;
using llmt::GateProblem;

// Curved outputs over correlated inputs, unequal weights; a, z and y as GateProblem asks for.
GateProblem problem(GateModels models, Eigen::Index rows, Eigen::Index inputs, std::uint64_t seed) {
  GateProblem result;
  llmt::Random random(seed);
  const Eigen::MatrixXd x = oracle::uniform(rows, inputs, seed) *
                            (Eigen::MatrixXd::Identity(inputs, inputs) + 0.5 * Eigen::MatrixXd::Ones(inputs, inputs));
  Eigen::MatrixXd y(rows, 2);
  y << oracle::curved(x, 0.1), (x.rowwise().sum().array() * 0.7).sin().matrix();
  result.weights.resize(rows);
  for (double& weight : result.weights) {
    weight = random.uniform(0.1, 1.0);
  }
  const double total = result.weights.sum();
  const Eigen::MatrixXd centred = x.rowwise() - result.weights.transpose() * x / total;
  const Eigen::MatrixXd covariance = centred.transpose() * result.weights.asDiagonal() * centred / total;
  const Eigen::MatrixXd white =
      centred * Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(covariance).operatorInverseSqrt();
  result.z.resize(rows, inputs + 1);
  result.z << white, Eigen::VectorXd::Ones(rows);
  result.a.resize(rows, inputs + 1);
  result.a << Eigen::VectorXd::Ones(rows), white;
  result.y = y - result.a * (result.a.transpose() * result.weights.asDiagonal() * y) / total;
  result.output_weights = Eigen::Vector2d(1.0, 2.5);
  result.models = models;
  return result;
}

Gate gate(Eigen::Index inputs, double half_width, std::uint64_t seed) {
  llmt::Random random(seed);
  Gate result(inputs + 1);
  for (double& entry : result) {
    entry = random.normal();
  }
  result.head(inputs) /= half_width * result.head(inputs).norm();
  return result;
}

// By Householder QR, nothing precomputed.
double loss(const GateProblem& problem, const Eigen::VectorXd& shares) {
  const Eigen::Index size = problem.a.cols();
  Eigen::MatrixXd b(problem.a.rows(), 2 * size);
  b << shares.asDiagonal() * problem.a, (1.0 - shares.array()).matrix().asDiagonal() * problem.a;
  const auto fit = [&](const Eigen::VectorXd& weights, const Eigen::MatrixXd& columns, Eigen::Index output) {
    const Eigen::VectorXd root = weights.cwiseSqrt();
    return oracle::least_squares(root.asDiagonal() * columns, root.cwiseProduct(problem.y.col(output)));
  };
  double sum = 0.0;
  for (Eigen::Index o = 0; o < problem.y.cols(); ++o) {
    Eigen::VectorXd coefficients(2 * size);
    if (problem.models == GateModels::joint) {
      coefficients = fit(problem.weights, b, o);
    } else {
      coefficients << fit(problem.weights.cwiseProduct(shares), problem.a, o),
          fit(problem.weights.cwiseProduct((1.0 - shares.array()).matrix()), problem.a, o);
    }
    sum += problem.output_weights(o) * problem.weights.dot((problem.y.col(o) - b * coefficients).cwiseAbs2());
  }
  return sum;
}

TEST(LogisticGate, IsTheLogisticFunctionToAFewUnitsInTheLastPlace) {
  double before = 2.0;
  for (double u = -40.0; u <= 40.0; u += 0.0137) {
    const double share = llmt::logistic(u);
    const double exact = 1.0 / (1.0 + std::exp(u));
    ASSERT_LE(share, before);
    ASSERT_NEAR(share, exact, u < llmt::logistic_reach ? 4e-16 * exact + 1e-300 : 1e-16) << u;
    before = share;
  }
  EXPECT_EQ(llmt::logistic(0.0), 0.5);
  for (const double far : {llmt::logistic_reach, 1e3, 1e308, std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(llmt::logistic(-far), 1.0);
    EXPECT_EQ(llmt::logistic(far), 0.0);
  }
}

TEST(ObliqueSplit, LossIsThatOfLeastSquares) {
  for (const GateModels models : {GateModels::local, GateModels::joint}) {
    for (const double half_width : {0.05, 0.4, 1.0}) {
      const GateProblem given = problem(models, 700, 3, 5);
      const Eigen::VectorXd shares = llmt::gate_shares(given, gate(3, half_width, 6));
      // The hold of 1e-9 changes the ninth digit at most.
      EXPECT_NEAR(llmt::share_loss(given, shares) / loss(given, shares), 1.0, 1e-7);
    }
  }
}

TEST(ObliqueSplit, GradientIsThatOfDifferences) {
  for (const GateModels models : {GateModels::local, GateModels::joint}) {
    for (const double half_width : {0.1, 0.7}) {
      const GateProblem given = problem(models, 600, 4, 15);
      const Gate at = gate(4, half_width, 16);
      const Eigen::VectorXd gradient = llmt::gate_gradient(given, at);
      for (Eigen::Index k = 0; k < at.size(); ++k) {
        const double step = 1e-4;
        const auto along = [&](double distance) {
          return llmt::share_loss(given, llmt::gate_shares(given, at + distance * Gate::Unit(at.size(), k)));
        };
        // Of fourth order, so that the step may be large against rounding.
        const double difference =
            (8.0 * (along(step) - along(-step)) - (along(2.0 * step) - along(-2.0 * step))) / (12.0 * step);
        EXPECT_NEAR(gradient(k), difference, 1e-7 * gradient.norm()) << k;
      }
    }
  }
}

TEST(ObliqueSplit, OptimumIsStationaryAndNotAboveItsStart) {
  for (const GateModels models : {GateModels::local, GateModels::joint}) {
    const GateProblem given = problem(models, 800, 3, 25);
    const llmt::GateFit start = llmt::best_threshold(given, Eigen::Vector3d(1.0, 0.2, 0.0), 0.4);
    const llmt::GateFit found = llmt::optimise_gate(given, start, 0.01, 10.0);
    EXPECT_NEAR(found.loss / llmt::share_loss(given, llmt::gate_shares(given, found.gate)), 1.0, 1e-12);
    EXPECT_LT(found.loss, 0.95 * start.loss);
    EXPECT_LE(found.evaluations, 50);
    EXPECT_LT(llmt::gate_gradient(given, found.gate).norm() * found.gate.norm(), 0.05 * found.loss);
    // A given half width stays.
    const llmt::GateFit narrow = llmt::optimise_gate(given, start, 0.2, 0.2);
    EXPECT_NEAR(narrow.gate.head(3).norm(), 5.0, 1e-9);
    EXPECT_LT(narrow.loss, llmt::share_loss(given, llmt::gate_shares(given, 2.0 * start.gate)));
  }
}

TEST(ObliqueSplit, ASideWithTooFewRowsIsRefused) {
  GateProblem given = problem(GateModels::local, 300, 2, 35);
  given.least_weight = 0.4 * given.weights.sum();
  Gate at = gate(2, 0.1, 36);
  at(2) = 1.5 / 0.1;  // beyond nearly all rows
  EXPECT_EQ(llmt::share_loss(given, llmt::gate_shares(given, at)), std::numeric_limits<double>::infinity());
  const llmt::GateFit found =
      llmt::optimise_gate(given, llmt::best_threshold(given, Eigen::Vector2d(1.0, 0.0), 0.1), 0.1, 0.1);
  const double left = given.weights.dot(llmt::gate_shares(given, found.gate));
  EXPECT_GE(std::min(left, given.weights.sum() - left), given.least_weight);
}

}  // namespace
