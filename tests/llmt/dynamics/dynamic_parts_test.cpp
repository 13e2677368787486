// The parts of a model that moves, where its numbers are known: terms, poles, bounds and states of rest.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "dynamics/grid.hpp"
#include "dynamics/held_out_runs.hpp"
#include "dynamics/model_structure.hpp"
#include "dynamics/one_step.hpp"
#include "dynamics/other_orders.hpp"
#include "dynamics/polynomial.hpp"
#include "dynamics/windows.hpp"
#include "llmt/dynamic_analysis.hpp"
#include "llmt/dynamics/systems.hpp"
#include "llmt/fit.hpp"
#include "llmt/fit_dynamic.hpp"
#include "llmt/lags.hpp"
#include "llmt/static_curve.hpp"

namespace {

// y(t) = a y(t-1) + b u(t - delay); with a lag of none y(t) = b u(t).
llmt::DynamicParts line_that_moves(double a, double b, bool has_past = true) {
  llmt::DynamicParts parts;
  parts.inputs = {{"u", "", -1.0, 1.0}};
  parts.outputs = {{"y", "", -1.0, 1.0}};
  parts.lags = has_past ? llmt::Lags{{{1}}, {{1}}} : llmt::Lags{{{}}, {{0}}};
  const Eigen::Index count = has_past ? 2 : 1;
  parts.polynomial.centre = Eigen::VectorXd::Zero(count);
  parts.polynomial.scale = Eigen::VectorXd::Ones(count);
  parts.polynomial.low = Eigen::VectorXd::Constant(count, -1.0);
  parts.polynomial.high = Eigen::VectorXd::Ones(count);
  parts.polynomial.terms = has_past ? std::vector<std::vector<int>>{{0}, {1}} : std::vector<std::vector<int>>{{0}};
  parts.polynomial.coefficients.resize(1, count);
  if (has_past) {
    parts.polynomial.coefficients << a, b;
  } else {
    parts.polynomial.coefficients << b;
  }
  return parts;
}

llmt::Series measured(const Eigen::VectorXd& inputs, const Eigen::VectorXd& outputs) {
  llmt::Series series;
  series.input_names = {"u"};
  series.output_names = {"y"};
  series.inputs = inputs;
  series.outputs = outputs;
  return series;
}

// Of n regressors (n + d over d) products have at most d factors.
TEST(DynamicParts, AsManyTermsAsTheBinomialCoefficientAndNoneOfDegreeZero) {
  EXPECT_TRUE(llmt::all_terms(3, 0).empty());
  EXPECT_EQ(llmt::number_of_terms(3, 0), 0.0);
  const double expected[] = {4.0, 10.0, 20.0};
  for (int degree = 1; degree <= 3; ++degree) {
    EXPECT_EQ(static_cast<double>(llmt::all_terms(3, degree).size()), expected[degree - 1]);
    EXPECT_EQ(llmt::number_of_terms(3, degree), expected[degree - 1]);
  }
}

// Beyond its range a held polynomial goes on along its linear terms, with their slope.
TEST(DynamicParts, AHeldPolynomialKeepsTheSlopesOfItsLinearTerms) {
  llmt::Polynomial polynomial;
  polynomial.is_held = true;
  polynomial.centre = Eigen::VectorXd::Constant(1, 0.5);
  polynomial.scale = Eigen::VectorXd::Constant(1, 2.0);
  polynomial.low = Eigen::VectorXd::Constant(1, -1.0);
  polynomial.high = Eigen::VectorXd::Constant(1, 1.0);
  polynomial.terms = {{}, {0}, {0, 0}};
  polynomial.coefficients.resize(1, 3);
  polynomial.coefficients << 7.0, 3.0, 5.0;
  const double x = 9.0;
  double z[2];
  llmt::standardise(polynomial, &x, z);
  Eigen::MatrixXd slopes = Eigen::MatrixXd::Zero(1, 1);
  llmt::add_polynomial_slopes(polynomial, &x, z, slopes);
  EXPECT_DOUBLE_EQ(slopes(0, 0), 3.0 / 2.0);
  polynomial.is_held = false;  // 3 / 2 + 5 d/dx ((x - 0.5) / 2)^2
  llmt::standardise(polynomial, &x, z);
  slopes.setZero();
  llmt::add_polynomial_slopes(polynomial, &x, z, slopes);
  EXPECT_DOUBLE_EQ(slopes(0, 0), 3.0 / 2.0 + 5.0 * 2.0 * (8.5 / 2.0) / 2.0);
}

// z = 1: s = 0, which neither swings nor dies away.
TEST(DynamicParts, AnIntegratorIsFullyDampedAndWithoutEnd) {
  const llmt::Pole pole = llmt::local_dynamics(llmt::DynamicModel(line_that_moves(1.0, 0.3))).front().poles.at(0);
  EXPECT_EQ(pole.z, std::complex<double>(1.0, 0.0));
  EXPECT_EQ(pole.frequency, 0.0);
  EXPECT_EQ(pole.damping, 1.0);
  EXPECT_EQ(pole.time_constant, std::numeric_limits<double>::infinity());
}

// The range is 2, so that an output may run from -21 to 21.
TEST(DynamicParts, ARunKeepsTheRowAtWhichItLeavesItsBounds) {
  const llmt::DynamicParts parts = line_that_moves(2.0, 0.0);
  Eigen::VectorXd outputs = Eigen::VectorXd::Ones(9);
  const llmt::Series series = measured(Eigen::VectorXd::Zero(9), outputs);
  Eigen::MatrixXd run;
  const Eigen::VectorXd lower = llmt::lower_bounds(parts.outputs);
  const Eigen::VectorXd upper = llmt::upper_bounds(parts.outputs);
  EXPECT_EQ(lower(0), -21.0);
  EXPECT_EQ(upper(0), 21.0);
  EXPECT_EQ(llmt::run_window(parts, series, {0, 1, 9}, lower, upper, run), 5);
  for (Eigen::Index row = 0; row <= 5; ++row) EXPECT_EQ(run(row, 0), std::exp2(static_cast<double>(row)));
  EXPECT_TRUE(run.bottomRows(3).array().isNaN().all());
}

// Rows from the one on at which a run leaves its bounds count with the bound, also if that is the first of all.
TEST(DynamicParts, ARunThatLeavesAtOnceIsJudgedByItsBound) {
  const llmt::DynamicParts parts = line_that_moves(0.0, 1.0, false);
  const Eigen::VectorXd inputs = (Eigen::VectorXd(3) << 100.0, 0.0, 0.0).finished();
  const llmt::Judged judged =
      llmt::judge_runs(parts, measured(inputs, Eigen::VectorXd::Ones(3)), llmt::windows_of({{0, 3}}, 0));
  EXPECT_EQ(judged.runs, 1);
  EXPECT_EQ(judged.diverged, 1);
  EXPECT_EQ(judged.squares(0), 3.0 * 20.0 * 20.0);
}

// y(t) = a y(t-1) + b u(t-1) over inputs that are high for long stretches in some order only. The record alternates, so
// its own run stays within its range; a run of ten times its rows meets more of the same side.
TEST(DynamicParts, RunsOverOtherOrdersLeaveTheRangeThatTheRecordKeeps) {
  Eigen::VectorXd inputs(200);
  for (Eigen::Index row = 0; row < inputs.size(); ++row) inputs(row) = row % 2 == 0 ? 1.0 : -1.0;
  const llmt::Series series = measured(inputs, Eigen::VectorXd::Zero(inputs.size()));
  const auto stays = [&](double a, double b) {
    const llmt::DynamicParts parts = line_that_moves(a, b);
    llmt::Task task = llmt::task_of(series, {});
    task.outputs = parts.outputs;  // -1 to 1, so the bounds are -21 and 21
    return llmt::stays_over_other_orders(task, parts, {{0, inputs.size()}});
  };
  // Over the record |y| stays below b / (1 + a); with one side for long it would be b / (1 - a).
  EXPECT_TRUE(stays(0.5, 0.5));
  EXPECT_TRUE(stays(0.9, 2.0));
  EXPECT_FALSE(stays(0.99, 10.0));  // 5.03 over the record
  EXPECT_FALSE(stays(1.05, 0.1));   // unstable
}

// Where an output adds up a run over other inputs may end anywhere, and without inputs there is no other order.
TEST(DynamicParts, OtherOrdersSayNothingOfOutputsThatAddUp) {
  const Eigen::VectorXd inputs = Eigen::VectorXd::LinSpaced(100, -1.0, 1.0);
  const llmt::Series series = measured(inputs, Eigen::VectorXd::Zero(100));
  llmt::DynamicParts parts = line_that_moves(1.05, 1.0);
  llmt::Task task = llmt::task_of(series, {});
  task.outputs = parts.outputs;
  EXPECT_FALSE(llmt::stays_over_other_orders(task, parts, {{0, 100}}));
  parts.lags.adds_up = {true};
  EXPECT_TRUE(llmt::stays_over_other_orders(task, parts, {{0, 100}}));
}

// Two outputs that do not see each other, each at rest at 2 b u. A state counts up to one range beyond the range.
TEST(DynamicParts, StatesOfRestLieWithinOneRangeOfTheRange) {
  llmt::DynamicParts parts;
  parts.inputs = {{"u", "", -1.0, 1.0}};
  parts.outputs = {{"p", "", -3.0, 3.0}, {"q", "", -3.0, 3.0}};
  parts.lags = {{{1}, {1}}, {{1}}};
  const auto states = [&](double at_rest) {
    Eigen::MatrixXd coefficients(2, 3);
    coefficients << 0.5, 0.0, 0.5 * at_rest, 0.0, 0.5, 0.5;
    parts.polynomial = {Eigen::VectorXd::Zero(3),          Eigen::VectorXd::Ones(3), Eigen::VectorXd::Constant(3, -3.0),
                        Eigen::VectorXd::Constant(3, 3.0), {{0}, {1}, {2}},          coefficients};
    return llmt::static_curve(llmt::DynamicModel(parts), 0, 2).points.size();
  };
  EXPECT_EQ(states(8.95), 2U);
  EXPECT_EQ(states(9.05), 0U);
}

TEST(DynamicParts, LagsOfAnOutputThatAddsUpBeginAtOne) {
  EXPECT_NO_THROW(llmt::check_lags({{{1, 3}}, {{1}}, {true}}));
  EXPECT_NO_THROW(llmt::check_lags({{{2}}, {{1}}, {false}}));
  EXPECT_THROW(llmt::check_lags({{{2}}, {{1}}, {true}}), std::invalid_argument);
  EXPECT_THROW(llmt::check_lags({{{}}, {{1}}, {true}}), std::invalid_argument);
}

// An output at its bound has not left it.
TEST(DynamicParts, ARunMayStandAtItsBound) {
  const llmt::DynamicParts parts = line_that_moves(1.0, 0.0);
  const llmt::Series series = measured(Eigen::VectorXd::Zero(5), Eigen::VectorXd::Constant(5, 21.0));
  Eigen::MatrixXd run;
  EXPECT_EQ(llmt::run_window(parts, series, {0, 1, 5}, llmt::lower_bounds(parts.outputs),
                             llmt::upper_bounds(parts.outputs), run),
            -1);
  EXPECT_EQ(run, series.outputs);
}

// Measured 1 and 3 in turn, simulated 0: a root mean square of sqrt 5 beside a deviation of 1.
TEST(DynamicParts, TheFitIsWhatTheDeviationLeavesOfTheError) {
  Eigen::VectorXd outputs(8);
  outputs << 1.0, 3.0, 1.0, 3.0, 1.0, 3.0, 1.0, 3.0;
  const llmt::DynamicModel model(line_that_moves(0.0, 1.0, false));
  const llmt::RunErrors errors = llmt::run_errors(model, measured(Eigen::VectorXd::Zero(8), outputs), 0);
  EXPECT_EQ(errors.rows, 8);
  EXPECT_NEAR(errors.rmse(0), std::sqrt(5.0), 1e-12);
  EXPECT_NEAR(errors.fit(0), 100.0 * (1.0 - std::sqrt(5.0)), 1e-9);
}

TEST(DynamicParts, TwoSignalsHaveTwoNames) {
  llmt::DynamicParts parts = line_that_moves(0.5, 0.3);
  EXPECT_NO_THROW(llmt::DynamicModel{parts});
  parts.inputs[0].name = "y";
  EXPECT_THROW(llmt::DynamicModel{parts}, std::invalid_argument);
}

// A ridge belongs to an estimate on runs.
TEST(DynamicParts, CandidatesOfOneStepHaveNoRidge) {
  for (const llmt::ModelStructure& candidate : llmt::all_candidates({{{1, 2}}, {{1}}}, {}, 1000)) {
    if (!candidate.on_runs) {
      EXPECT_EQ(candidate.ridge, 0.0);
    }
  }
}

// Five rows behind the two that begin a run, begun again at each: 5 errors after one row, 4 after two, ..., and too few
// for more than one list. Their mean row is (5 + 2) / 3.
TEST(DynamicParts, AllErrorsOfAShortStretchAreInOneList) {
  const llmt::Series series = systems::record(67, 3, systems::oscillator, 0.05);
  const llmt::Task task = llmt::task_of(series, {});
  const llmt::ModelStructure linear{.lags = {{{1, 2}}, {{1}}}, .on_runs = false};
  llmt::Work work;
  const llmt::HeldOutRuns runs = llmt::held_out_runs(task, linear, {{{{0, 60}}, {{60, 67}}}}, 1, 5, work);
  EXPECT_EQ(runs.band.longest, 5);
  ASSERT_EQ(runs.band.outputs.at(0).size(), 1U);
  EXPECT_EQ(runs.band.outputs[0][0].errors.size(), 15U);
  EXPECT_NEAR(runs.band.outputs[0][0].rows, 7.0 / 3.0, 1e-12);
  EXPECT_TRUE(runs.simulated.topRows(62).array().isNaN().all());
  EXPECT_TRUE(runs.simulated.bottomRows(5).allFinite());
}

// A tree for each of two outputs: derivatives by regressors and by parameters are those of differences.
TEST(DynamicParts, EachTreeOfSeveralOutputsHasItsDerivatives) {
  llmt::Random random(5);
  Eigen::MatrixXd x(200, 3);
  Eigen::MatrixXd y(200, 2);
  for (Eigen::Index i = 0; i < 200; ++i) {
    for (Eigen::Index j = 0; j < 3; ++j) x(i, j) = random.uniform(-1.0, 1.0);
    y.row(i) << std::abs(x(i, 0)) + x(i, 2), x(i, 1) * x(i, 1) - x(i, 0);
  }
  llmt::DynamicParts parts;
  parts.inputs = {{"u", "", -1.0, 1.0}};
  parts.outputs = {{"p", "", -1.0, 2.0}, {"q", "", -1.0, 2.0}};
  parts.lags = {{{1}, {1}}, {{1}}};
  parts.polynomial = llmt::fit_polynomial(x, y, 0, 0.0);
  llmt::FitOptions options;
  options.validity = llmt::ValidityChoice::blend;
  options.max_leaves = 4;
  options.folds.count = 0;
  parts.rest = llmt::fit(x, y, options).model;
  ASSERT_EQ(std::get<llmt::Model>(parts.rest).partitions().size(), 2U);
  const auto value = [](const llmt::DynamicParts& of, const Eigen::VectorXd& at) {
    Eigen::VectorXd result(2);
    llmt::OneStep(of).values(at.data(), result.data());
    return result;
  };
  const Eigen::Vector3d at(0.05, 0.1, 0.3);
  Eigen::VectorXd here(2);
  Eigen::MatrixXd by_regressor;
  Eigen::MatrixXd by_parameter;
  llmt::OneStep(parts).derivatives(at.data(), here.data(), by_regressor, by_parameter);
  constexpr double h = 1e-6;
  for (int j = 0; j < 3; ++j) {
    const Eigen::Vector3d step = h * Eigen::Vector3d::Unit(j);
    const Eigen::VectorXd slope = (value(parts, at + step) - value(parts, at - step)) / (2.0 * h);
    EXPECT_LT((by_regressor.col(j) - slope).norm(), 1e-6) << j;
  }
  const Eigen::VectorXd parameters = llmt::parameters_of(parts);
  ASSERT_EQ(by_parameter.rows(), parameters.size());
  for (Eigen::Index k = 0; k < parameters.size(); ++k) {
    Eigen::VectorXd moved = parameters;
    moved(k) += h;
    const Eigen::VectorXd slope = (value(llmt::with_parameters(parts, moved), at) - here) / h;
    EXPECT_LT((by_parameter.row(k).transpose() - slope).norm(), 1e-6) << k;
  }
}

}  // namespace
