// Models of systems that move, against closed forms, differences and independent estimates.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <complex>
#include <limits>
#include <stdexcept>

#include "dynamics/model_structure.hpp"
#include "dynamics/one_step.hpp"
#include "dynamics/output_error.hpp"
#include "dynamics/polynomial.hpp"
#include "dynamics/sensitivities.hpp"
#include "dynamics/windows.hpp"
#include "llmt/dynamic_analysis.hpp"
#include "llmt/dynamic_source.hpp"
#include "llmt/dynamics/systems.hpp"
#include "llmt/fit.hpp"
#include "llmt/fit_dynamic.hpp"
#include "llmt/simulator.hpp"
#include "oracles/clamped.hpp"
#include "oracles/compiled_c.hpp"

namespace {

using llmt::DynamicParts;
using llmt::Series;

llmt::DynamicParts parts_for(const Series& series, const llmt::Lags& lags, int degree, bool is_held = false) {
  DynamicParts parts;
  parts.inputs = {{"u", "V", series.inputs.minCoeff(), series.inputs.maxCoeff()}};
  parts.outputs = {{"y", "m", series.outputs.minCoeff(), series.outputs.maxCoeff()}};
  parts.sample_time = series.sample_time;
  parts.lags = lags;
  const llmt::RegressorRows rows = regressor_rows(series, lags, {{0, series.rows()}}, llmt::longest_lag(lags));
  parts.polynomial = llmt::fit_polynomial(rows.regressors, rows.outputs, degree, 0.0);
  parts.polynomial.is_held = is_held;
  return parts;
}

// The rest of a model: a tree fitted to what its polynomial leaves.
void add_tree(DynamicParts& parts, const Series& series, llmt::GrowthRule rule, Eigen::Index leaves) {
  const llmt::RegressorRows rows =
      regressor_rows(series, parts.lags, {{0, series.rows()}}, llmt::longest_lag(parts.lags));
  llmt::OneStep map(parts);
  Eigen::MatrixXd rest = rows.outputs;
  for (Eigen::Index row = 0; row < rest.rows(); ++row) {
    const Eigen::VectorXd x = rows.regressors.row(row).transpose();
    double y = 0.0;
    map.values(x.data(), &y);
    rest(row, 0) -= y;
  }
  llmt::FitOptions options;
  options.rule = rule;
  options.max_leaves = leaves;
  options.folds.count = 0;
  options.choose_inputs = false;
  if (rule == llmt::GrowthRule::rd) {
    options.significance = llmt::every_split;
    options.validity = llmt::ValidityChoice::blend;
  }
  parts.rest = llmt::fit(rows.regressors, rest, options).model;
}

const llmt::Lags second_order{{{1, 2}}, {{1}}};

TEST(Dynamics, ALinearSystemIsRecoveredToRounding) {
  Series series = systems::record(300, 1, systems::oscillator);
  series.sample_time = 0.1;
  llmt::DynamicOptions options;
  options.lags = second_order;
  options.rest = llmt::RestLearner::none;
  const llmt::DynamicFit fit = llmt::fit_dynamic(series, options);
  EXPECT_LT(fit.summary.held_out.rmse(0), 1e-10);
  const llmt::LocalDynamics local = llmt::local_dynamics(fit.model).front();
  ASSERT_EQ(local.poles.size(), 2U);
  EXPECT_LT(std::abs(local.poles[0].z - std::polar(0.8, 0.5)), 1e-9);
  EXPECT_LT(std::abs(local.poles[1].z - std::polar(0.8, -0.5)), 1e-9);
  // s = (ln 0.8 + 0.5 i) / 0.1
  const double size = std::hypot(std::log(0.8), 0.5) / 0.1;
  EXPECT_NEAR(local.poles[0].frequency, size / (2.0 * M_PI), 1e-8);
  EXPECT_NEAR(local.poles[0].damping, -std::log(0.8) / 0.1 / size, 1e-8);
  EXPECT_NEAR(local.poles[0].time_constant, -0.1 / std::log(0.8), 1e-8);
  EXPECT_NEAR(local.steady_gain(0, 0), 0.5 / (1.0 - systems::a1 - systems::a2), 1e-8);
  EXPECT_TRUE(local.is_stable);
}

// y(t) = a y(t-1) + b u(t-1) + c, simulated by hand; Gauss-Newton steps from numeric differences of the run, halved
// until the squares fall.
TEST(Dynamics, TheOutputErrorEstimateIsThatOfAnIndependentSolver) {
  const Series series = systems::record(
      200, 2, [](double y1, double, double u1) { return 0.85 * y1 + 0.4 * u1 + 0.1; }, 0.3);
  const auto errors = [&](const Eigen::Vector3d& at) {
    Eigen::VectorXd result(series.rows() - 1);
    double y = series.outputs(0, 0);
    for (Eigen::Index row = 1; row < series.rows(); ++row) {
      y = at(0) * y + at(1) * series.inputs(row - 1, 0) + at(2);
      result(row - 1) = series.outputs(row, 0) - y;
    }
    return result;
  };
  const auto cost = [&](const Eigen::Vector3d& at) { return errors(at).squaredNorm(); };
  Eigen::Vector3d best(0.6, 0.1, 0.0);
  constexpr double h = 1e-6;
  for (int iteration = 0; iteration < 60; ++iteration) {
    Eigen::MatrixXd slopes(series.rows() - 1, 3);
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d step = h * Eigen::Vector3d::Unit(i);
      slopes.col(i) = (errors(best + step) - errors(best - step)) / (2.0 * h);
    }
    Eigen::Vector3d move = slopes.colPivHouseholderQr().solve(errors(best));
    while (!(cost(best - move) <= cost(best)) && move.norm() > 1e-13) move *= 0.5;
    best -= move;
  }
  const llmt::Lags lags{{{1}}, {{1}}};
  const DynamicParts start = parts_for(series, lags, 1);
  const llmt::OutputErrorResult found =
      llmt::estimate_on_runs(start, series, llmt::windows_of({{0, series.rows()}}, 1), Eigen::VectorXd::Ones(1),
                             {.iterations = 100, .enough = 0.0});
  EXPECT_NEAR(found.cost, cost(best), 1e-6 * cost(best));
  const llmt::LocalDynamics local = llmt::local_dynamics(llmt::DynamicModel(found.parts)).front();
  EXPECT_NEAR(local.poles[0].z.real(), best(0), 1e-6);
  EXPECT_NEAR(local.steady_gain(0, 0), best(1) / (1.0 - best(0)), 1e-4);
  // Least squares of the next row is biased by the noise.
  const double biased = llmt::local_dynamics(llmt::DynamicModel(start)).front().poles[0].z.real();
  EXPECT_GT(std::abs(biased - 0.85), 3.0 * std::abs(best(0) - 0.85));
}

struct SensitivityCase {
  const char* name;
  int degree;
  bool is_held;
  bool has_tree;
  llmt::GrowthRule rule;
  bool has_stop;
  bool adds_up = false;
  bool is_clamped = false;
};

TEST(Dynamics, SensitivitiesAreThoseOfDifferences) {
  const SensitivityCase cases[] = {
      {"polynomial", 3, false, false, llmt::GrowthRule::rd, false},
      {"held polynomial", 3, true, false, llmt::GrowthRule::rd, false},
      {"blend", 1, false, true, llmt::GrowthRule::rd, false},
      {"gates", 0, false, true, llmt::GrowthRule::hilomot, false},
      {"Gaussians", 1, false, true, llmt::GrowthRule::lolimot, false},
      {"stops", 2, true, false, llmt::GrowthRule::rd, true},
      {"adds up", 1, false, true, llmt::GrowthRule::lolimot, false, true},
      {"adds up to a stop", 2, true, false, llmt::GrowthRule::rd, true, true},
      {"clamped gates", 0, false, true, llmt::GrowthRule::hilomot, false, false, true},
  };
  const Series series = systems::record(150, 3, systems::duffing, 0.05, 2.0);
  for (const SensitivityCase& of : cases) {
    SCOPED_TRACE(of.name);
    DynamicParts parts = parts_for(series, {{{1, 2}}, {{1, 2}}, {of.adds_up}}, of.degree, of.is_held);
    if (of.has_tree) add_tree(parts, series, of.rule, 3);
    if (of.is_clamped) parts.rest = oracle::clamped(std::get<llmt::Model>(parts.rest), Eigen::RowVector2d(-0.4, 0.6));
    if (of.has_stop) parts.outputs[0].upper_stop = 0.5 * parts.outputs[0].high;
    const std::vector<llmt::Window> windows = llmt::windows_of({{0, 80}, {90, 150}}, 2);
    const Eigen::VectorXd scale = Eigen::VectorXd::Constant(1, 2.0);
    const llmt::RunEquations equations = run_equations(parts, series, windows, scale);
    ASSERT_TRUE(std::isfinite(equations.cost));
    EXPECT_DOUBLE_EQ(equations.cost, run_cost(parts, series, windows, scale));
    const Eigen::VectorXd at = llmt::parameters_of(parts);
    ASSERT_EQ(at.size(), equations.gradient.size());
    Eigen::VectorXd differences(at.size());
    for (Eigen::Index k = 0; k < at.size(); ++k) {
      const double step = 1e-6 * std::max(1e-2, std::abs(at(k)));
      Eigen::VectorXd moved = at;
      moved(k) += step;
      const double above = run_cost(llmt::with_parameters(parts, moved), series, windows, scale);
      moved(k) -= 2.0 * step;
      const double below = run_cost(llmt::with_parameters(parts, moved), series, windows, scale);
      differences(k) = -0.5 * (above - below) / (2.0 * step);
    }
    EXPECT_LT((differences - equations.gradient).norm(), 1e-5 * (1.0 + differences.norm()));
  }
}

// Rows are added 128 at a time: a run of as many leaves none.
TEST(Dynamics, RunsOfAnyLengthHaveTheirEquations) {
  const Series series = systems::record(300, 3, systems::duffing, 0.05, 2.0);
  const DynamicParts parts = parts_for(series, second_order, 1);
  const Eigen::VectorXd scale = Eigen::VectorXd::Ones(1);
  for (const Eigen::Index rows : {1, 127, 128, 256}) {
    const llmt::RunEquations equations = run_equations(parts, series, {{0, 2, 2 + rows}}, scale);
    EXPECT_EQ(equations.rows, static_cast<double>(rows));
    EXPECT_DOUBLE_EQ(equations.cost, run_cost(parts, series, {{0, 2, 2 + rows}}, scale)) << rows;
  }
}

// A stretch so short that no tree is learned leaves a model without parameters, which predicts nothing.
TEST(Dynamics, TooFewRowsForATreeLeaveNoParameters) {
  const Series series = systems::record(60, 3, systems::duffing, 0.05, 2.0);
  const llmt::Task task = llmt::task_of(series, {});
  const llmt::ModelStructure tree{
      .lags = {{{1, 2}}, {{1, 2}}}, .degree = 0, .rest = llmt::RestKind::tree, .leaves = 2, .on_runs = true};
  EXPECT_EQ(llmt::parameters_of(llmt::estimate(task, tree, {{0, 15}}, 5)).size(), 0);
  EXPECT_GT(llmt::parameters_of(llmt::estimate(task, tree, {{0, 60}}, 5)).size(), 0);
}

class DynamicC : public oracle::CompiledC {};

const char* const driver = R"(#include <stdio.h>
#include "drive.h"
int main(void) {
  struct drive_state state;
  double row[2], past_u[GIVEN], past_y[GIVEN], y;
  int k;
  for (k = 0; fread(row, sizeof(double), 2, stdin) == 2; ++k) {
    if (k < GIVEN) {
      past_u[k] = row[0];
      y = past_y[k] = row[1];
      if (k == GIVEN - 1) drive_start(&state, GIVEN, past_u, past_y);
    } else if (drive_step(&state, row, &y) != 0) {
      return 3;
    }
    fwrite(&y, sizeof(double), 1, stdout);
  }
  return 0;
}
)";

TEST_F(DynamicC, RunsToTheBytesOfTheLibrary) {
  const Series series = systems::record(300, 4, systems::duffing, 0.02, 2.0);
  std::vector<std::pair<std::string, DynamicParts>> models;
  for (const int degree : {1, 2, 3}) {
    models.emplace_back(fmt::format("degree {}", degree), parts_for(series, {{{1, 2}}, {{0, 1}}}, degree, degree == 2));
  }
  models.emplace_back("hilomot", parts_for(series, {{{1, 3}}, {{1}}}, 0));
  add_tree(models.back().second, series, llmt::GrowthRule::hilomot, 3);
  models.emplace_back("blend with stops", parts_for(series, {{{1, 2}}, {{1, 4}}}, 1));
  add_tree(models.back().second, series, llmt::GrowthRule::rd, 4);
  models.back().second.outputs[0].upper_stop = 0.5;
  models.emplace_back("adds up to a stop", parts_for(series, {{{1, 2}}, {{1, 4}}, {true}}, 1));
  add_tree(models.back().second, series, llmt::GrowthRule::lolimot, 3);
  models.back().second.outputs[0].upper_stop = 0.5;
  models.emplace_back("no past", parts_for(series, {{{}}, {{0}}}, 2));
  const Series asked = systems::record(400, 5, systems::duffing, 0.0, 3.0);
  for (const auto& [name, parts] : models) {
    const llmt::DynamicModel model(parts);
    for (const Eigen::Index given : {1, 2, 6}) {
      SCOPED_TRACE(fmt::format("{} begun by {} rows", name, given));
      oracle::Rows in(asked.rows(), 2);
      in << asked.inputs, asked.outputs;
      const std::string text = fmt::format("enum {{ GIVEN = {} }};\n", given) + driver;
      const oracle::Rows out = run_c(llmt::to_c(model, "drive", "drive.h"), "drive", text, in, 1);
      const llmt::Run run = llmt::simulate(model, asked.inputs, asked.outputs.topRows(given));
      ASSERT_EQ(run.left_at, -1);
      EXPECT_TRUE((out.array() == run.outputs.array()).all()) << (out - run.outputs).cwiseAbs().maxCoeff() << " apart";
    }
  }
}

TEST(Dynamics, FilesReadBackToTheSameRun) {
  const Series series = systems::record(200, 6, systems::duffing, 0.05, 2.0);
  DynamicParts parts = parts_for(series, {{{1, 2}}, {{1}}, {true}}, 2, true);
  add_tree(parts, series, llmt::GrowthRule::hilomot, 3);
  parts.outputs[0].lower_stop = -1.0;
  parts.is_stable = false;
  const llmt::DynamicModel model(parts);
  const std::string text = llmt::to_json(model);
  const llmt::DynamicModel again = llmt::dynamic_from_json(text);
  EXPECT_EQ(llmt::to_json(again), text);
  EXPECT_FALSE(again.parts().is_stable);
  EXPECT_EQ(again.parts().outputs[0].unit, "m");
  const Eigen::MatrixXd initial = series.outputs.topRows(2);
  EXPECT_EQ(llmt::simulate(again, series.inputs, initial).outputs,
            llmt::simulate(model, series.inputs, initial).outputs);
}

// What a file may have instead, and what the message names.
TEST(Dynamics, FilesThatDoNotFitAreRefusedWithTheirPlace) {
  const Series series = systems::record(100, 7, systems::oscillator);
  const std::string text = llmt::to_json(llmt::DynamicModel(parts_for(series, second_order, 1)));
  const std::vector<std::array<std::string, 3>> cases = {
      {"\"version\": 1", "\"version\": 2", "version 2"},
      {"llmt-dynamic-model", "llmt-model", "llmt fit --lags makes one"},
      {"\"held_out_runs\": \"stable\"", "\"held_out_runs\": \"so so\"", "/held_out_runs"},
      {"\"sample_time\": 1.0", "\"sample_time\": 0.0", "sample time"},
      {"\"beyond_range\": \"polynomial\"", "\"beyond_range\": \"cubic\"", "/polynomial/beyond_range"},
      {"\"unit\": \"m\"", "\"unit\": 3", "/outputs/0/unit"},
  };
  for (const auto& [part, other, message] : cases) {
    std::string changed = text;
    ASSERT_NE(changed.find(part), std::string::npos) << part;
    changed.replace(changed.find(part), part.size(), other);
    try {
      llmt::dynamic_from_json(changed, "m.json");
      ADD_FAILURE() << other;
    } catch (const std::runtime_error& error) {
      EXPECT_EQ(std::string(error.what()).find("m.json"), 0U) << error.what();
      EXPECT_NE(std::string(error.what()).find(message), std::string::npos) << error.what();
    }
  }
  EXPECT_THROW(llmt::dynamic_from_json(text.substr(0, text.size() / 2)), std::runtime_error);
  EXPECT_THROW(llmt::from_json(text), std::runtime_error);
}

TEST(Dynamics, ARunSaysWhereItLeavesTheDataAndTheBounds) {
  const Series series = systems::record(200, 8, systems::oscillator);
  DynamicParts parts = parts_for(series, second_order, 1);
  const llmt::DynamicModel model(parts);
  Eigen::MatrixXd inputs = Eigen::MatrixXd::Zero(60, 1);
  inputs(20, 0) = 5.0;  // looked at one row later
  const llmt::Run run = llmt::simulate(model, inputs, Eigen::MatrixXd::Zero(1, 1));
  EXPECT_EQ(run.first, 1);
  EXPECT_EQ(run.outside_at, 21);
  EXPECT_EQ(run.left_at, -1);
  parts.polynomial.coefficients(0, 1) *= 1.5;  // y(t - 1): poles outside of the unit circle
  const llmt::DynamicModel unstable(parts);
  EXPECT_FALSE(llmt::local_dynamics(unstable).front().is_stable);
  const llmt::Run away = llmt::simulate(unstable, inputs, Eigen::MatrixXd::Constant(1, 1, 0.1));
  ASSERT_GT(away.left_at, 0);
  const double last = away.outputs(away.left_at, 0);
  EXPECT_TRUE(last > unstable.upper(0) || last < unstable.lower(0));
  EXPECT_TRUE(away.outputs.topRows(away.left_at).allFinite());
  EXPECT_TRUE(away.outputs.bottomRows(60 - away.left_at - 1).array().isNaN().all());
}

}  // namespace
