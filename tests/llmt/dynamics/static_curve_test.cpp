// States of rest, step responses and spectra, against closed forms and long runs.
#include "llmt/static_curve.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <stdexcept>

#include "llmt/dynamic_analysis.hpp"
#include "llmt/dynamics/systems.hpp"
#include "llmt/fit_dynamic.hpp"
#include "llmt/simulator.hpp"

namespace {

using llmt::Series;

// A polynomial model of one output and one input; the regressors are not scaled.
llmt::DynamicParts polynomial_model(const llmt::Lags& lags, std::vector<std::vector<int>> terms,
                                    const std::vector<double>& coefficients) {
  llmt::DynamicParts parts;
  parts.inputs = {{"u", "V", -1.0, 1.0}};
  parts.outputs = {{"y", "m", -1.5, 1.5}};
  parts.lags = lags;
  const Eigen::Index count = std::ssize(llmt::columns_of(lags));
  parts.polynomial = {Eigen::VectorXd::Zero(count),
                      Eigen::VectorXd::Ones(count),
                      Eigen::VectorXd::Constant(count, -1.5),
                      Eigen::VectorXd::Constant(count, 1.5),
                      std::move(terms),
                      Eigen::Map<const Eigen::RowVectorXd>(coefficients.data(), std::ssize(coefficients))};
  return parts;
}

// Where a run of many rows ends.
double end_of_run(const llmt::DynamicModel& model, double input, double start) {
  const Eigen::MatrixXd inputs = Eigen::MatrixXd::Constant(5000, 1, input);
  return llmt::simulate(model, inputs, Eigen::MatrixXd::Constant(1, 1, start)).outputs(4999, 0);
}

TEST(StaticCurve, OfALinearModelIsItsGain) {
  // y(t) = 0.5 + 0.6 y(t-1) + 0.2 (y(t-1) - y(t-2)) + 0.3 u(t-1)
  const llmt::DynamicModel model(polynomial_model({{{1, 2}}, {{1}}}, {{}, {0}, {1}, {2}}, {0.5, 0.6, 0.2, 0.3}));
  const llmt::StaticCurve curve = llmt::static_curve(model, 0, 5);
  ASSERT_EQ(curve.points.size(), 5U);
  for (std::size_t k = 0; k < 5; ++k) {
    const llmt::RestPoint& point = curve.points[k];
    EXPECT_DOUBLE_EQ(point.input, -1.0 + 0.5 * static_cast<double>(k));
    EXPECT_NEAR(point.outputs(0), (0.5 + 0.3 * point.input) / 0.4, 1e-9);
    EXPECT_TRUE(point.is_stable);
    EXPECT_EQ(point.is_inside, std::abs((0.5 + 0.3 * point.input) / 0.4) <= 1.5);
  }
  EXPECT_TRUE(curve.none.empty());
}

// y(t) = y(t-1) + 0.2 (y(t-1) - y(t-1)^3) + 0.1 u: for small inputs two states and an unstable one between them.
TEST(StaticCurve, FindsAllStatesAndWhichAreUnstable) {
  const llmt::DynamicModel model(polynomial_model({{{1}}, {{1}}}, {{0}, {1}, {0, 0, 0}}, {1.2, 0.1, -0.2}));
  const llmt::StaticCurve curve = llmt::static_curve(model, 0, 3);
  ASSERT_EQ(curve.points.size(), 5U);  // one at u = -1, three at 0, one at 1
  EXPECT_NEAR(curve.points[1].outputs(0), -1.0, 1e-9);
  EXPECT_NEAR(curve.points[2].outputs(0), 0.0, 1e-9);
  EXPECT_NEAR(curve.points[3].outputs(0), 1.0, 1e-9);
  EXPECT_TRUE(curve.points[1].is_stable);
  EXPECT_FALSE(curve.points[2].is_stable);
  EXPECT_TRUE(curve.points[3].is_stable);
  for (const std::size_t k : {0U, 1U, 3U, 4U}) {
    const llmt::RestPoint& point = curve.points[k];
    EXPECT_NEAR(end_of_run(model, point.input, point.outputs(0) + 0.01), point.outputs(0), 1e-9);
  }
  EXPECT_GT(std::abs(end_of_run(model, 0.0, 0.01) - curve.points[2].outputs(0)), 0.9);
}

TEST(StaticCurve, SaysWhereThereIsNone) {
  // y(t) = y(t-1) + 0.5 + u^2: never at rest.
  const llmt::DynamicModel away(polynomial_model({{{1}}, {{1}}}, {{}, {0}, {1, 1}}, {0.5, 1.0, 1.0}));
  const llmt::StaticCurve none = llmt::static_curve(away, 0, 4);
  EXPECT_TRUE(none.points.empty());
  EXPECT_EQ(none.none.size(), 4U);
  const llmt::DynamicModel sum(polynomial_model({{{1, 2}}, {{1}}, {true}}, {{0}, {1}}, {0.5, 1.0}));
  EXPECT_EQ(llmt::static_curve(sum, 0, 4).none.size(), 4U);
  EXPECT_THROW(llmt::static_curve(sum, 1), std::invalid_argument);
  EXPECT_THROW(llmt::static_curve(sum, 0, 1), std::invalid_argument);
  EXPECT_THROW(llmt::static_curve(sum, 0, 4, Eigen::VectorXd::Zero(2)), std::invalid_argument);
}

TEST(StaticCurve, EndsAtAStop) {
  // Gain 5, a stop at 1: at u = 1 it is pushed against the stop, at u = 0.1 it is free.
  llmt::DynamicParts parts = polynomial_model({{{1, 2}}, {{1}}}, {{0}, {1}, {2}}, {0.8, 0.1, 1.0});
  parts.outputs[0].upper_stop = 1.0;
  parts.inputs[0].low = 0.1;
  const llmt::DynamicModel model(parts);
  const llmt::StaticCurve curve = llmt::static_curve(model, 0, 2);
  ASSERT_EQ(curve.points.size(), 2U);
  EXPECT_NEAR(curve.points[0].outputs(0), 0.5, 1e-9);
  EXPECT_FALSE(curve.points[0].is_at_stop);
  EXPECT_EQ(curve.points[1].outputs(0), 1.0);
  EXPECT_TRUE(curve.points[1].is_at_stop);
  EXPECT_TRUE(curve.points[1].is_stable);
  EXPECT_EQ(end_of_run(model, 1.0, 0.2), 1.0);
}

TEST(StaticCurve, OfTwoOutputsIsTheSolutionOfTheirEquations) {
  llmt::DynamicParts parts;
  parts.inputs = {{"u", "", -1.0, 1.0}, {"w", "", 0.0, 2.0}};
  parts.outputs = {{"p", "", -3.0, 3.0}, {"q", "", -3.0, 3.0}};
  parts.lags = {{{1}, {1}}, {{1}, {1}}};
  Eigen::Matrix2d a;
  a << 0.7, 0.2, -0.3, 0.5;
  Eigen::Matrix2d b;
  b << 0.1, 0.4, 0.3, -0.2;
  Eigen::MatrixXd coefficients(2, 4);
  coefficients << a, b;
  parts.polynomial = {Eigen::VectorXd::Zero(4),          Eigen::VectorXd::Ones(4), Eigen::VectorXd::Constant(4, -3.0),
                      Eigen::VectorXd::Constant(4, 3.0), {{0}, {1}, {2}, {3}},     coefficients};
  const llmt::StaticCurve curve = llmt::static_curve(llmt::DynamicModel(parts), 0, 3);
  ASSERT_EQ(curve.points.size(), 3U);
  for (const llmt::RestPoint& point : curve.points) {
    // The other input stays in the middle of its range.
    const Eigen::Vector2d rest = (Eigen::Matrix2d::Identity() - a).inverse() * b * Eigen::Vector2d(point.input, 1.0);
    EXPECT_LT((point.outputs - rest).norm(), 1e-7);
  }
  const llmt::StaticCurve other = llmt::static_curve(llmt::DynamicModel(parts), 1, 2, Eigen::Vector2d(0.5, 0.0));
  const Eigen::Vector2d rest = (Eigen::Matrix2d::Identity() - a).inverse() * b * Eigen::Vector2d(0.5, 2.0);
  EXPECT_LT((other.points.back().outputs - rest).norm(), 1e-7);
}

TEST(StepResponse, OfAFirstOrderIsItsClosedForm) {
  const llmt::DynamicModel model(polynomial_model({{{1}}, {{2}}}, {{0}, {1}}, {0.9, 0.3}));
  const llmt::LocalDynamics local = llmt::local_dynamics(model).front();
  const Eigen::MatrixXd response = llmt::step_response(local, 0, 60);
  for (int row = 0; row < 60; ++row) {
    EXPECT_NEAR(response(row, 0), row < 2 ? 0.0 : 0.3 * (1.0 - std::pow(0.9, row - 1)) / 0.1, 1e-12) << row;
  }
  // 0.9^(n - 1) <= 0.02
  EXPECT_EQ(llmt::settled_rows(local), 1 + static_cast<Eigen::Index>(std::ceil(std::log(0.02) / std::log(0.9))));
  EXPECT_THROW(llmt::step_response(local, 1, 10), std::invalid_argument);
  const llmt::DynamicModel sum(polynomial_model({{{1, 2}}, {{1}}, {true}}, {{0}, {1}}, {0.5, 1.0}));
  const llmt::LocalDynamics of_sum = llmt::local_dynamics(sum).front();
  EXPECT_EQ(llmt::settled_rows(of_sum), -1);
  EXPECT_NEAR(llmt::step_response(of_sum, 0, 40)(39, 0) - llmt::step_response(of_sum, 0, 40)(38, 0), 2.0, 1e-9);
}

TEST(StepResponse, OfALinearModelIsItsRun) {
  const llmt::DynamicModel model(polynomial_model({{{1, 3}}, {{0, 2}}}, {{0}, {1}, {2}, {3}}, {0.8, -0.3, 0.2, 0.1}));
  const Eigen::MatrixXd response = llmt::step_response(llmt::local_dynamics(model).front(), 0, 30);
  Eigen::MatrixXd inputs = Eigen::MatrixXd::Ones(31, 1);
  inputs(0, 0) = 0.0;
  const llmt::Run run = llmt::simulate(model, inputs, Eigen::MatrixXd::Zero(1, 1));
  EXPECT_LT((run.outputs.bottomRows(30) - response).cwiseAbs().maxCoeff(), 1e-12);
}

// The gain is 1 for negative inputs and 3 for positive ones. An oblique tree says so where it rests.
TEST(LocalModels, OfAnObliqueTreeAreThoseOfItsStatesOfRest) {
  const auto next = [](double y1, double, double u1) { return 0.8 * y1 + (u1 < 0.0 ? 0.2 : 0.6) * u1; };
  llmt::DynamicOptions options;
  options.lags = llmt::Lags{{{1}}, {{1}}};
  options.rest = llmt::RestLearner::tree;
  options.rule = llmt::GrowthRule::hilomot;
  options.max_leaves = 2;
  const llmt::DynamicFit fit = llmt::fit_dynamic(systems::record(600, 41, next), options);
  ASSERT_TRUE(std::holds_alternative<llmt::Model>(fit.model.parts().rest));
  const std::vector<llmt::LocalDynamics> all = llmt::local_dynamics(fit.model);
  ASSERT_EQ(all.size(), 5U);
  EXPECT_NEAR(all.front().steady_gain(0, 0), 1.0, 0.15);
  EXPECT_NEAR(all.back().steady_gain(0, 0), 3.0, 0.3);
  EXPECT_NEAR(all.back().poles.front().z.real(), 0.8, 0.03);
}

// A dead time adds no pole: those at z = 0 are not found by an eigenvalue of many equal ones.
TEST(LocalModels, ADeadTimeAddsNoPole) {
  const llmt::DynamicModel model(polynomial_model({{{1}}, {{6}}}, {{0}, {1}}, {0.9, 0.3}));
  const llmt::LocalDynamics local = llmt::local_dynamics(model).front();
  ASSERT_EQ(local.poles.size(), 1U);
  EXPECT_NEAR(local.poles[0].z.real(), 0.9, 1e-12);
  EXPECT_NEAR(llmt::step_response(local, 0, 40)(39, 0), 3.0 * (1.0 - std::pow(0.9, 34)), 1e-12);
}

TEST(ResidualSpectrum, HasThePowerOfTheErrorsAndTheirPeak) {
  // The model is right but for a hum of 0.1 in 1/row that it does not know.
  const llmt::DynamicModel model(polynomial_model({{{1}}, {{1}}}, {{0}, {1}}, {0.5, 1.0}));
  Series series = systems::record(2000, 42, [](double y1, double, double u1) { return 0.5 * y1 + u1; });
  const Series clean = series;
  llmt::Random random(43);
  for (Eigen::Index row = 0; row < 2000; ++row) {
    series.outputs(row, 0) += 0.2 * std::sin(2.0 * M_PI * 0.1 * static_cast<double>(row)) + 0.05 * random.normal();
  }
  const llmt::ResidualTests tests = llmt::residual_tests(model, series, clean.outputs).front();
  ASSERT_EQ(tests.frequency.size(), 128);
  Eigen::Index peak = 0;
  tests.run_spectrum.maxCoeff(&peak);
  EXPECT_NEAR(tests.frequency(peak), 0.1, 1.0 / 256.0);
  const double width = tests.frequency(1) - tests.frequency(0);
  EXPECT_NEAR(tests.run_spectrum.sum() * width, 0.5 * 0.04 + 0.0025, 0.001);
  // Far from the peak white noise has a level line: 2 variance / (2 * highest frequency).
  EXPECT_NEAR(tests.run_spectrum.tail(60).mean(), 0.0025 / 0.5, 0.001);
}

}  // namespace
