// What is chosen by runs over held-out stretches.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <stdexcept>

#include "llmt/dynamic_analysis.hpp"
#include "llmt/dynamics/systems.hpp"
#include "llmt/fit_dynamic.hpp"
#include "llmt/static_curve.hpp"

namespace {

using llmt::Series;

const llmt::Lags of_second_order{{{1, 2}}, {{1}}};

// A tank that overflows: the level is held, and falls again as soon as less flows in than out.
TEST(DynamicChoice, AStopIsFoundAndHelps) {
  const auto next = [](double y1, double y2, double u1) { return std::min(1.0, 1.7 * y1 - 0.72 * y2 + 0.03 * u1); };
  const Series series = systems::record(600, 9, next, 0.0, 3.0);
  ASSERT_GT((series.outputs.array() == 1.0).count(), 20);
  llmt::DynamicOptions options;
  options.lags = of_second_order;
  options.rest = llmt::RestLearner::none;
  const llmt::DynamicFit fit = llmt::fit_dynamic(series, options);
  EXPECT_EQ(fit.model.parts().outputs[0].upper_stop, 1.0);
  EXPECT_EQ(fit.model.parts().outputs[0].lower_stop, -std::numeric_limits<double>::infinity());
}

// A tank whose outflow is a root of its level. Of 300 rows with noise the polynomial of least error has a state of rest
// within its range that it does not come back to, and over other inputs it swings about it.
TEST(DynamicChoice, AModelThatIsUnstableAtRestGivesWayToOneThatIsHardlyWorse) {
  std::uint32_t state = 10;
  const auto drawn = [&] {
    state = 1664525U * state + 1013904223U;
    return state / 4294967296.0;
  };
  for (int k = 0; k < 5; ++k) drawn();
  constexpr Eigen::Index rows = 300;
  Series series;
  series.input_names = {"u"};
  series.output_names = {"y"};
  series.inputs.resize(rows, 1);
  series.outputs.resize(rows, 1);
  double level = 0.5, before = 0.0, u = 0.0;
  for (Eigen::Index row = 0; row < rows; ++row) {
    if (row % 3 == 0) u = 2.0 * drawn() - 1.0;
    level += 0.0565 * (before + 1.0) - 0.1234 * std::sqrt(level);
    series.inputs(row, 0) = u;
    const double noise = drawn() + drawn() + drawn() - 1.5;
    series.outputs(row, 0) = level + 0.004 * noise;
    before = u;
  }
  llmt::DynamicOptions options;
  options.lags = llmt::Lags{{{1, 2}}, {{0, 1, 2, 3, 4}}};
  const llmt::DynamicFit fit = llmt::fit_dynamic(series, options);
  const llmt::StaticCurve curve = llmt::static_curve(fit.model, 0);
  for (const llmt::RestPoint& rest : curve.points) EXPECT_TRUE(rest.is_stable || !rest.is_inside) << rest.input;
  const llmt::DynamicSummary& summary = fit.summary;
  EXPECT_GT(summary.compared[summary.chosen].error, summary.compared.front().error);
  EXPECT_LT(summary.compared[summary.chosen].error, 1.1 * summary.compared.front().error);
}

// A slide driven by a force: its position adds up. The value of the position says nothing, and a model that uses it
// has a pole near 1 that is wrong over a long run.
TEST(DynamicChoice, AnOutputThatAddsUpHasItsPoleAtOne) {
  const auto slide = [](double y1, double y2, double u1) { return y1 + 0.9 * (y1 - y2) + 0.1 * u1; };
  const Series series = systems::record(200, 21, slide, 0.02);
  llmt::DynamicOptions options;
  options.rest = llmt::RestLearner::none;
  const llmt::DynamicFit fit = llmt::fit_dynamic(series, options);
  EXPECT_EQ(fit.model.parts().lags.adds_up, std::vector<bool>{true});
  const llmt::LocalDynamics local = llmt::local_dynamics(fit.model).front();
  EXPECT_NEAR(std::abs(local.poles.front().z - 1.0), 0.0, 1e-12);
  EXPECT_TRUE(std::isnan(local.steady_gain(0, 0)));
  options.lags = fit.model.parts().lags;
  options.lags->adds_up.clear();
  const llmt::DynamicFit with_value = llmt::fit_dynamic(series, options);
  const Series longer = systems::record(2000, 22, slide);
  const double error = llmt::run_errors(fit.model, longer, 3, 0).rmse(0);
  EXPECT_LT(error, 0.5 * llmt::run_errors(with_value.model, longer, 3, 0).rmse(0));
  // And a system that comes back is not taken for one.
  options.lags.reset();
  EXPECT_TRUE(llmt::fit_dynamic(systems::record(200, 23, systems::oscillator, 0.02), options)
                  .model.parts()
                  .lags.adds_up.empty());
}

// Cheap models say which lags are worth the others' time.
TEST(DynamicChoice, OnlyTheFiveBestLagsMeetAllCandidates) {
  llmt::DynamicOptions options;
  options.rest = llmt::RestLearner::none;
  const llmt::DynamicFit fit = llmt::fit_dynamic(systems::record(300, 24, systems::duffing, 0.05, 2.0), options);
  std::vector<llmt::Lags> compared;
  for (const llmt::DynamicCandidate& candidate : fit.summary.compared) {
    if (std::ranges::find(compared, candidate.lags) == compared.end()) compared.push_back(candidate.lags);
  }
  EXPECT_GE(compared.size(), 2U);
  EXPECT_LE(compared.size(), 5U);
}

// What never changes is no past to look at.
TEST(DynamicChoice, AnInputThatNeverChangesHasNoLags) {
  Series series = systems::record(200, 12, systems::oscillator);
  series.input_names = {"u", "still"};
  series.inputs.conservativeResize(Eigen::NoChange, 2);
  series.inputs.col(1).setConstant(3.0);
  llmt::DynamicOptions options;
  options.rest = llmt::RestLearner::none;
  const llmt::Lags lags = llmt::fit_dynamic(series, options).model.parts().lags;
  EXPECT_FALSE(lags.inputs[0].empty());
  EXPECT_TRUE(lags.inputs[1].empty());
  series.inputs.col(0).setZero();
  EXPECT_TRUE(llmt::fit_dynamic(series, options).model.parts().lags.inputs[0].empty());
}

// Two outputs that drive each other, one record behind the other.
TEST(DynamicChoice, OutputsAreInputsOfEachOther) {
  llmt::Random random(10);
  Series series;
  series.input_names = {"u"};
  series.output_names = {"p", "q"};
  series.inputs.resize(400, 1);
  series.outputs.resize(400, 2);
  series.record_begins = {0, 250};
  Eigen::Matrix2d a;
  a << 0.9, 0.2, -0.3, 0.7;
  Eigen::Vector2d y = Eigen::Vector2d::Zero();
  double u = 0.0;
  for (Eigen::Index row = 0; row < 400; ++row) {
    if (row == 250) y.setConstant(1.0);
    y = row == 0 || row == 250 ? y : Eigen::Vector2d(a * y + Eigen::Vector2d(0.0, 1.0) * u);
    u = random.uniform(-1.0, 1.0);
    series.outputs.row(row) = y.transpose();
    series.inputs(row, 0) = u;
  }
  llmt::DynamicOptions options;
  options.lags = llmt::Lags{{{1}, {1}}, {{1}}};
  options.rest = llmt::RestLearner::none;
  const llmt::DynamicFit fit = llmt::fit_dynamic(series, options);
  EXPECT_LT(fit.summary.held_out.rmse.maxCoeff(), 1e-10);
  const llmt::LocalDynamics local = llmt::local_dynamics(fit.model).front();
  ASSERT_EQ(local.poles.size(), 2U);
  // Eigenvalues of a: 0.8 +- i sqrt(0.06 - 0.01)
  EXPECT_LT(std::abs(local.poles[0].z - std::complex<double>(0.8, std::sqrt(0.05))), 1e-9);
  const Eigen::Vector2d gain = (Eigen::Matrix2d::Identity() - a).inverse() * Eigen::Vector2d(0.0, 1.0);
  EXPECT_LT((local.steady_gain - gain).norm(), 1e-8);
}

// y(t) = 0.8 y(t-1) + 0.5 u(t-8): a dead time of seven rows before the one of the model.
TEST(DynamicChoice, ADeadTimeIsFoundOrGiven) {
  Series series = systems::record(400, 15, systems::oscillator, 0.0);
  llmt::Random random(16);
  for (Eigen::Index row = 0; row < 400; ++row) {
    const double before = row > 0 ? series.outputs(row - 1, 0) : 0.0;
    series.outputs(row, 0) = 0.8 * before + (row >= 8 ? 0.5 * series.inputs(row - 8, 0) : 0.0) + 0.01 * random.normal();
  }
  llmt::DynamicOptions options;
  options.rest = llmt::RestLearner::none;
  options.lags = llmt::Lags{{{1}}, {{1}}};
  options.delays = {llmt::find_delay};
  const llmt::DynamicFit found = llmt::fit_dynamic(series, options);
  EXPECT_EQ(found.summary.delays, std::vector<int>{7});
  EXPECT_EQ(found.model.parts().lags.inputs[0], std::vector<int>{8});
  options.delays = {7};
  EXPECT_EQ(llmt::to_json(llmt::fit_dynamic(series, options).model), llmt::to_json(found.model));
  options.delays = {6};
  EXPECT_GT(llmt::fit_dynamic(series, options).summary.held_out.rmse(0), 3.0 * found.summary.held_out.rmse(0));
  // Lags that are chosen begin there too.
  options.lags.reset();
  options.delays = {8};
  const llmt::DynamicFit chosen = llmt::fit_dynamic(series, options);
  EXPECT_EQ(chosen.model.parts().lags.inputs[0].front(), 8);
  options.delays = {1, 2};
  EXPECT_THROW(llmt::fit_dynamic(series, options), std::invalid_argument);
  options.delays = {-2};
  EXPECT_THROW(llmt::fit_dynamic(series, options), std::invalid_argument);
}

// The errors of all dead times of an input that never changes are alike.
TEST(DynamicChoice, AnInputThatNeverChangesHasNoDeadTime) {
  Series series = systems::record(400, 17, systems::oscillator, 0.0);
  llmt::Random random(18);
  series.inputs.conservativeResize(Eigen::NoChange, 2);
  series.input_names = {"u", "c"};
  for (Eigen::Index row = 0; row < 400; ++row) {
    const double before = row > 0 ? series.outputs(row - 1, 0) : 0.0;
    series.outputs(row, 0) = 0.8 * before + (row >= 4 ? 0.5 * series.inputs(row - 4, 0) : 0.0) + 0.01 * random.normal();
    series.inputs(row, 1) = 5.0;
  }
  llmt::DynamicOptions options;
  options.rest = llmt::RestLearner::none;
  options.lags = llmt::Lags{{{1}}, {{1}, {1}}};
  options.delays = {llmt::find_delay, llmt::find_delay};
  EXPECT_EQ(llmt::fit_dynamic(series, options).summary.delays, (std::vector<int>{3, 0}));
}

// u acts after four rows, v not at all, w after more rows than are tried.
TEST(DynamicChoice, AnInputThatDoesNothingHasNoDeadTime) {
  constexpr Eigen::Index rows = 600;
  Series series = systems::record(rows, 19, systems::oscillator, 0.0);
  llmt::Random random(20);
  series.inputs.conservativeResize(Eigen::NoChange, 3);
  series.input_names = {"u", "v", "w"};
  for (Eigen::Index row = 0; row < rows; ++row) {
    series.inputs(row, 1) = row % 3 == 0 || row == 0 ? random.normal() : series.inputs(row - 1, 1);
    series.inputs(row, 2) = random.normal();
    const double before = row > 0 ? series.outputs(row - 1, 0) : 0.0;
    series.outputs(row, 0) = 0.8 * before + (row >= 5 ? 0.5 * series.inputs(row - 5, 0) : 0.0) +
                             (row >= 60 ? 0.02 * series.inputs(row - 60, 2) : 0.0) + 0.01 * random.normal();
  }
  llmt::DynamicOptions options;
  options.rest = llmt::RestLearner::none;
  options.lags = llmt::Lags{{{1}}, {{1}, {1}, {1}}};
  options.delays = {llmt::find_delay, llmt::find_delay, llmt::find_delay};
  const llmt::DynamicFit fit = llmt::fit_dynamic(series, options);
  EXPECT_EQ(fit.summary.delays, (std::vector<int>{4, llmt::no_delay_helps, llmt::no_delay_helps}));
  EXPECT_EQ(fit.model.parts().lags.inputs, (std::vector<std::vector<int>>{{5}, {1}, {1}}));
}

TEST(DynamicChoice, DeadTimesAreReadWithTheirInputs) {
  EXPECT_EQ(llmt::parse_delays("v:3", {"u", "v"}, llmt::find_delay), (std::vector<int>{-1, 3}));
  EXPECT_EQ(llmt::parse_delays("v:3,u:0", {"u", "v"}, 9), (std::vector<int>{0, 3}));
  for (const char* wrong : {"", "u", "u:", "u:-1", "u:x", "w:1", "u:1,u:2", "u:1.5", "u:99999"}) {
    EXPECT_THROW(llmt::parse_delays(wrong, {"u", "v"}, 0), std::invalid_argument) << wrong;
  }
}

TEST(DynamicChoice, ASpringThatStiffensIsFoundBeyondALinearModel) {
  const Series series = systems::record(800, 11, systems::duffing, 0.02, 3.0);
  llmt::DynamicOptions options;
  options.lags = llmt::Lags{{{1, 2}}, {{1}}};
  const llmt::DynamicFit fit = llmt::fit_dynamic(series, options);
  // The noise of 0.02 is not predictable; the runs begin with two noisy rows.
  EXPECT_LT(fit.summary.held_out.rmse(0), 0.03);
  EXPECT_GT(fit.summary.linear.rmse(0), 4.0 * fit.summary.held_out.rmse(0));
  EXPECT_TRUE(fit.model.parts().is_stable);
  EXPECT_EQ(fit.summary.continuation, "polynomial");
  const Series other = systems::record(800, 12, systems::duffing, 0.0, 3.0);
  EXPECT_LT(llmt::run_errors(fit.model, other, 2).rmse(0), 0.03);
}

TEST(DynamicChoice, TheSameAtAnyNumberOfThreads) {
  const Series series = systems::record(200, 13, systems::duffing, 0.05, 2.0);
  llmt::DynamicOptions options;
  options.lags = of_second_order;
  options.max_threads = 1;
  const std::string one = llmt::to_json(llmt::fit_dynamic(series, options).model);
  options.max_threads = 3;
  EXPECT_EQ(llmt::to_json(llmt::fit_dynamic(series, options).model), one);
}

TEST(DynamicChoice, SeriesFromWhichNothingCanBeLearnedAreRefused) {
  const Series good = systems::record(200, 14, systems::oscillator);
  const auto refused = [](Series series, const std::string& message) {
    try {
      llmt::fit_dynamic(series);
      ADD_FAILURE() << message;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(message), std::string::npos) << error.what();
    }
  };
  Series series = good;
  series.outputs.setConstant(2.0);
  refused(series, "never changes");
  series = good;
  series.outputs(3, 0) = std::numeric_limits<double>::infinity();
  refused(series, "outputs(3, 0) is inf");
  series = good;
  series.outputs.conservativeResize(20, 1);
  series.inputs.conservativeResize(20, 1);
  refused(series, "20 complete rows");
  series = good;
  series.input_names = {"y"};
  refused(series, "two signals are \"y\"");
  series = good;
  series.record_begins = {0, 100, 50};
  refused(series, "record_begins has 50");
  series = good;
  for (Eigen::Index row = 0; row < 200; row += 2) series.inputs(row, 0) = std::nan("");
  refused(series, "0 complete rows");
}

}  // namespace
