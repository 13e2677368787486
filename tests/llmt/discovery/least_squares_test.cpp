#include "llmt/discovery/least_squares.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "noise.hpp"

namespace llmt::discovery {
namespace {

LeastSquaresProblem linear_problem(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& target) {
  LeastSquaresProblem problem;
  for (Eigen::Index k = 0; k < matrix.cols(); ++k) {
    problem.parameters.push_back({.name = {'p', static_cast<char>('0' + k)}, .unit = "mm"});
  }
  problem.residual = [=](const Eigen::VectorXd& d) -> Eigen::VectorXd { return matrix * d - target; };
  problem.jacobian = [=](const Eigen::VectorXd&) { return matrix; };
  return problem;
}

Eigen::MatrixXd random_matrix(Eigen::Index rows, Eigen::Index columns, std::uint64_t seed) {
  Noise noise(seed);
  Eigen::MatrixXd matrix(rows, columns);
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (Eigen::Index j = 0; j < columns; ++j) matrix(i, j) = noise.normal();
  }
  return matrix;
}

// y = a exp(-b t), a textbook nonlinear fit.
LeastSquaresProblem decay_problem(double a, double b, double noise_sigma, std::uint64_t seed) {
  Noise noise(seed);
  const Eigen::VectorXd t = Eigen::VectorXd::LinSpaced(60, 0.0, 3.0);
  Eigen::VectorXd y = a * (-b * t.array()).exp();
  for (double& value : y) value += noise_sigma * noise.normal();
  LeastSquaresProblem problem;
  problem.parameters = {{.name = "a", .unit = "", .value = 1.0}, {.name = "b", .unit = "1/s", .value = 0.2}};
  problem.residual = [=](const Eigen::VectorXd& d) -> Eigen::VectorXd {
    return d(0) * (-d(1) * t.array()).exp() - y.array();
  };
  problem.jacobian = [=](const Eigen::VectorXd& d) {
    Eigen::MatrixXd jacobian(t.size(), 2);
    jacobian.col(0) = (-d(1) * t.array()).exp();
    jacobian.col(1) = -d(0) * t.array() * (-d(1) * t.array()).exp();
    return jacobian;
  };
  return problem;
}

TEST(LeastSquares, LinearProblemEqualsNormalEquationsInOneStep) {
  const Eigen::MatrixXd matrix = random_matrix(40, 5, 1);
  const Eigen::VectorXd target = random_matrix(40, 1, 2);
  const SolverResult result = solve(linear_problem(matrix, target), {.damping = 0.0});
  const Eigen::VectorXd expected = (matrix.transpose() * matrix).ldlt().solve(matrix.transpose() * target);
  EXPECT_LT((result.values - expected).norm(), 1e-12);
  EXPECT_EQ(result.iterations, 1);
  EXPECT_TRUE(result.converged()) << result.reason;
  const Eigen::MatrixXd covariance =
      (matrix.transpose() * matrix).inverse() * (matrix * expected - target).squaredNorm() / 35.0;
  EXPECT_LT((result.covariance - covariance).norm(), 1e-12);
  EXPECT_EQ(result.dof, 35);
}

TEST(LeastSquares, ConditionFiguresEqualThoseOfTheSingularValues) {
  const Eigen::MatrixXd matrix = random_matrix(30, 4, 3);
  const SolverResult result = solve(linear_problem(matrix, Eigen::VectorXd::Ones(30)));
  const Eigen::VectorXd s = Eigen::JacobiSVD<Eigen::MatrixXd>(matrix).singularValues();
  EXPECT_NEAR(result.condition_number, s(0) / s(3), 1e-12);
  EXPECT_NEAR(result.calibrability, std::pow(s(0) / s(3), 2), 1e-11);
}

TEST(LeastSquares, ParameterScalesDoNotMoveTheMinimum) {
  LeastSquaresProblem problem = decay_problem(2.0, 1.5, 0.01, 4);
  const SolverResult reference = solve(problem);
  problem.parameters[0].scale = 1e4;
  problem.parameters[1].scale = 1e-3;
  const SolverResult scaled = solve(problem);
  EXPECT_TRUE(scaled.converged()) << scaled.reason;
  EXPECT_LT((scaled.values - reference.values).norm(), 1e-7);
  EXPECT_LT((scaled.standard_errors - reference.standard_errors).norm(), 1e-6 * reference.standard_errors.norm());
}

TEST(LeastSquares, DifferencesServeWhereNoJacobianIsGiven) {
  LeastSquaresProblem problem = decay_problem(2.0, 1.5, 0.01, 5);
  EXPECT_LT(check_jacobian(problem).error, 1e-8);
  const SolverResult analytic = solve(problem);
  problem.jacobian = nullptr;
  const SolverResult differences = solve(problem);
  EXPECT_TRUE(differences.converged()) << differences.reason;
  EXPECT_LT((analytic.values - differences.values).norm(), 1e-6);
}

TEST(LeastSquares, WrongJacobianIsNamed) {
  LeastSquaresProblem problem = decay_problem(2.0, 1.5, 0.0, 6);
  const Jacobian good = problem.jacobian;
  problem.jacobian = [good](const Eigen::VectorXd& d) {
    Eigen::MatrixXd jacobian = good(d);
    jacobian(17, 1) += 0.1;
    return jacobian;
  };
  const JacobianCheck check = check_jacobian(problem);
  EXPECT_GT(check.error, 0.01);
  EXPECT_EQ(check.parameter, "b");
  EXPECT_EQ(check.row, 17);
}

TEST(LeastSquares, UnidentifiableCombinationIsNamedAndStaysAtItsStart) {
  Eigen::MatrixXd matrix = random_matrix(30, 4, 7);
  matrix.col(3) = 2.0 * matrix.col(1);  // only p1 + 2 p3 matters
  LeastSquaresProblem problem = linear_problem(matrix, matrix * Eigen::Vector4d(1.0, 2.0, 3.0, 0.0));
  problem.parameters[1].value = 5.0;
  problem.parameters[3].value = -1.5;  // p1 + 2 p3 = 2 already
  const SolverResult result = solve(problem);
  ASSERT_EQ(result.unidentifiable.size(), 1u);
  EXPECT_EQ(result.unidentifiable[0].names(), "p1, p3");
  EXPECT_NEAR(result.unidentifiable[0].terms[0].coefficient, -2.0 * result.unidentifiable[0].terms[1].coefficient,
              1e-12);
  EXPECT_EQ(result.rank, 3);
  EXPECT_NEAR(result.values(1), 5.0, 1e-10);
  EXPECT_NEAR(result.values(3), -1.5, 1e-10);
  EXPECT_NEAR(result.values(0), 1.0, 1e-10);
  EXPECT_TRUE(std::isnan(result.standard_error("p1")));
  EXPECT_TRUE(std::isfinite(result.standard_error("p0")));
  EXPECT_TRUE(result.converged());
}

TEST(LeastSquares, SeveralNullDirectionsComeApart) {
  Eigen::MatrixXd matrix = random_matrix(30, 5, 8);
  matrix.col(1) = matrix.col(0);
  matrix.col(4) = -matrix.col(2);
  const SolverResult result = solve(linear_problem(matrix, Eigen::VectorXd::Ones(30)));
  ASSERT_EQ(result.unidentifiable.size(), 2u);
  std::vector<std::string> names = {result.unidentifiable[0].names(), result.unidentifiable[1].names()};
  std::ranges::sort(names);
  EXPECT_EQ(names[0], "p0, p1");
  EXPECT_EQ(names[1], "p2, p4");
}

TEST(LeastSquares, FewerRowsThanParametersGiveTheNearestSolution) {
  const Eigen::MatrixXd matrix = random_matrix(3, 5, 9);
  const Eigen::VectorXd target = Eigen::VectorXd::Ones(3);
  const SolverResult result = solve(linear_problem(matrix, target), {.damping = 0.0});
  const Eigen::VectorXd expected = matrix.transpose() * (matrix * matrix.transpose()).ldlt().solve(target);
  EXPECT_LT((result.values - expected).norm(), 1e-10);
  EXPECT_EQ(result.unidentifiable.size(), 2u);
}

TEST(LeastSquares, PriorMakesAFlatDirectionIdentifiable) {
  Eigen::MatrixXd matrix = random_matrix(30, 2, 10);
  matrix.col(1) = matrix.col(0);
  LeastSquaresProblem problem = linear_problem(matrix, matrix.col(0) * 2.0);
  problem.parameters[0].prior_sigma = 1e-3;
  problem.parameters[1].prior_sigma = 1e3;
  const SolverResult result = solve(problem);
  EXPECT_TRUE(result.unidentifiable.empty());
  EXPECT_NEAR(result.values(0), 0.0, 1e-5);
  EXPECT_NEAR(result.values(1), 2.0, 1e-4);
}

TEST(LeastSquares, FixedParametersStayAndHaveNoError) {
  LeastSquaresProblem problem = decay_problem(2.0, 1.5, 0.01, 11);
  problem.parameters[1].free = false;
  problem.parameters[1].value = 1.5;
  const SolverResult result = solve(problem);
  EXPECT_EQ(result.values(1), 1.5);
  EXPECT_EQ(result.standard_errors(1), 0.0);
  EXPECT_NEAR(result.values(0), 2.0, 0.02);
}

TEST(LeastSquares, WeightsCountRowsAsOftenAsTheirSquares) {
  const Eigen::MatrixXd matrix = random_matrix(20, 2, 12);
  const Eigen::VectorXd target = random_matrix(20, 1, 13);
  LeastSquaresProblem weighted = linear_problem(matrix, target);
  weighted.weights = Eigen::VectorXd::Ones(20);
  weighted.weights.head(5).setConstant(2.0);
  Eigen::MatrixXd repeated(35, 2);
  Eigen::VectorXd repeated_target(35);
  repeated << matrix, matrix.topRows(5), matrix.topRows(5), matrix.topRows(5);
  repeated_target << target, target.head(5), target.head(5), target.head(5);
  EXPECT_LT((solve(weighted).values - solve(linear_problem(repeated, repeated_target)).values).norm(), 1e-9);
}

// The spread of estimates over many noisy repetitions is what standard errors claim. 400 repetitions: the standard
// deviation of an estimated standard deviation is 1/sqrt(800) = 3.5 %; four of those bound the ratio.
TEST(LeastSquares, StandardErrorsEqualTheMonteCarloSpread) {
  constexpr int repetitions = 400;
  Eigen::MatrixXd estimates(repetitions, 2);
  Eigen::Vector2d claimed = Eigen::Vector2d::Zero();
  for (int i = 0; i < repetitions; ++i) {
    const SolverResult result = solve(decay_problem(2.0, 1.5, 0.02, 1000 + static_cast<std::uint64_t>(i)));
    ASSERT_TRUE(result.converged());
    estimates.row(i) = result.values.transpose();
    claimed += result.standard_errors / repetitions;
  }
  const Eigen::MatrixXd centred = estimates.rowwise() - estimates.colwise().mean();
  const Eigen::Vector2d spread = (centred.colwise().squaredNorm() / (repetitions - 1.0)).cwiseSqrt().transpose();
  EXPECT_NEAR(claimed(0) / spread(0), 1.0, 0.14);
  EXPECT_NEAR(claimed(1) / spread(1), 1.0, 0.14);
}

TEST(LeastSquares, DampingSucceedsWhereFullStepsDiverge) {
  LeastSquaresProblem problem;  // atan: full Newton steps diverge from |x| > 1.39
  problem.parameters = {{.name = "x", .unit = "", .value = 3.0}};
  problem.residual = [](const Eigen::VectorXd& d) { return Eigen::VectorXd::Constant(1, std::atan(d(0))); };
  const SolverResult undamped = solve(problem, {.damping = 0.0});
  EXPECT_EQ(undamped.termination, Termination::diverged);
  EXPECT_EQ(undamped.values(0), 3.0);
  const SolverResult damped = solve(problem);
  EXPECT_TRUE(damped.converged()) << damped.reason;
  EXPECT_NEAR(damped.values(0), 0.0, 1e-9);
}

TEST(LeastSquares, OneIterationIsNotConvergence) {
  const SolverResult result = solve(decay_problem(2.0, 1.5, 0.01, 14), {.max_iterations = 1});
  EXPECT_EQ(result.termination, Termination::max_iterations);
  EXPECT_FALSE(result.converged());
  EXPECT_EQ(result.iterations, 1);
}

TEST(LeastSquares, WrongSignOfTheJacobianIsNotConvergence) {
  LeastSquaresProblem problem = decay_problem(2.0, 1.5, 0.01, 15);
  const Jacobian good = problem.jacobian;
  problem.jacobian = [good](const Eigen::VectorXd& d) -> Eigen::MatrixXd { return -good(d); };
  EXPECT_EQ(solve(problem).termination, Termination::stalled);
  EXPECT_EQ(solve(problem, {.damping = 0.0}).termination, Termination::diverged);
}

TEST(LeastSquares, ResidualsThatLeaveTheFiniteAreReported) {
  LeastSquaresProblem problem;
  problem.parameters = {{.name = "x", .unit = "", .value = 1.0}};
  problem.residual = [](const Eigen::VectorXd& d) {
    return Eigen::VectorXd::Constant(1, d(0) < 1.0 ? std::numeric_limits<double>::quiet_NaN() : d(0));
  };
  problem.jacobian = [](const Eigen::VectorXd&) { return Eigen::MatrixXd::Ones(1, 1); };
  EXPECT_EQ(solve(problem, {.damping = 0.0}).termination, Termination::non_finite);
  EXPECT_EQ(solve(problem).termination, Termination::non_finite);
  EXPECT_EQ(solve(problem).values(0), 1.0);
}

TEST(LeastSquares, NothingFreeAndNothingMovingAreSaid) {
  LeastSquaresProblem problem = decay_problem(2.0, 1.5, 0.01, 16);
  for (Parameter& p : problem.parameters) p.free = false;
  EXPECT_EQ(solve(problem).termination, Termination::no_free_parameters);
  const SolverResult still = solve(linear_problem(Eigen::MatrixXd::Zero(5, 2), Eigen::VectorXd::Ones(5)));
  EXPECT_EQ(still.termination, Termination::no_information);
  EXPECT_EQ(still.unidentifiable.size(), 2u);
}

TEST(LeastSquares, ExactDataConverge) {
  const SolverResult result = solve(decay_problem(2.0, 1.5, 0.0, 17));
  EXPECT_TRUE(result.converged()) << result.reason;
  EXPECT_NEAR(result.values(1), 1.5, 1e-10);
  EXPECT_TRUE(std::ranges::is_sorted(result.residual_norms, std::greater<>()));
}

TEST(LeastSquares, CallersMistakesNameTheField) {
  const auto message_of = [](const LeastSquaresProblem& problem, const SolverOptions& options) -> std::string {
    try {
      solve(problem, options);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "no error";
  };
  const LeastSquaresProblem good = decay_problem(2.0, 1.5, 0.01, 18);
  EXPECT_NE(message_of(good, {.damping = -1.0}).find("damping is -1"), std::string::npos);
  LeastSquaresProblem bad = good;
  bad.parameters[1].name = "a";
  EXPECT_NE(message_of(bad, {}).find("\"a\" is there twice"), std::string::npos);
  bad = good;
  bad.parameters[0].scale = 0.0;
  EXPECT_NE(message_of(bad, {}).find("scale is 0"), std::string::npos);
  bad = good;
  bad.parameters[0].value = std::numeric_limits<double>::infinity();
  EXPECT_NE(message_of(bad, {}).find("value is inf"), std::string::npos);
  bad = good;
  bad.weights = Eigen::VectorXd::Ones(3);
  EXPECT_NE(message_of(bad, {}).find("weights has 3"), std::string::npos);
  bad = good;
  bad.residual = [](const Eigen::VectorXd&) { return Eigen::VectorXd::Constant(3, std::nan("")); };
  EXPECT_NE(message_of(bad, {}).find("residual 0 is nan"), std::string::npos);
}

}  // namespace
}  // namespace llmt::discovery
