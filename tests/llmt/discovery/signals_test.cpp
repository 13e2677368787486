#include "llmt/discovery/signals.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "discovery/signals/kernel.hpp"
#include "llmt/random.hpp"

namespace signals_test {
namespace {

using namespace llmt::discovery;

constexpr double pi = std::numbers::pi;

// The gain as the header defines it; s from gain(cutoff) = 1/sqrt(2), by bisection.
double gain_of(double frequency, double width) {
  const double x = 0.5 * std::pow(2.0 * pi * frequency * width, 2);
  return std::exp(-x) * (1.0 + x + x * x / 2.0 + x * x * x / 6.0);
}

double width_for(double cutoff) {
  double low = 0.0;
  double high = 10.0 / cutoff;
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (low + high);
    (gain_of(cutoff, middle) > std::sqrt(0.5) ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

// Integral over all frequencies of (2 pi f)^(2 power) H^exponent.
double integral(double width, int power, int exponent) {
  const double last = 2.0 / width;
  constexpr int steps = 20000;
  double sum = 0.0;
  for (int i = 0; i < steps; ++i) {
    const double f = (i + 0.5) * last / steps;
    sum += std::pow(2.0 * pi * f, 2 * power) * std::pow(gain_of(f, width), exponent);
  }
  return 2.0 * sum * last / steps;
}

Log log_of(Eigen::Index rows, double rate, const std::function<double(double)>& position,
           const std::function<double(double)>& torque) {
  Log log;
  log.time = Eigen::VectorXd::LinSpaced(rows, 0.0, static_cast<double>(rows - 1)) / rate;
  log.positions = log.time.unaryExpr(position);
  log.torques = log.time.unaryExpr(torque);
  return log;
}

const SignalsOptions all_rows{.cutoff = 10.0, .standstill = {0.0}};

TEST(Signals, ASineKeepsItsPhaseAndHasTheGainOfTheEquationAndItsDerivatives) {
  const double width = width_for(10.0);
  for (const double frequency : {0.5, 2.0, 5.0, 10.0, 15.0}) {
    const double w = 2.0 * pi * frequency;
    const Log log = log_of(
        3000, 500.0, [&](double t) { return std::sin(w * t); }, [&](double t) { return std::cos(w * t); });
    const Signals table = signals(log, all_rows);
    const double gain = gain_of(frequency, width);
    const Eigen::ArrayXd phase = w * table.time.array();
    EXPECT_LT((table.positions.col(0).array() - gain * phase.sin()).abs().maxCoeff(), 1e-6) << frequency;
    EXPECT_LT((table.velocities.col(0).array() - gain * w * phase.cos()).abs().maxCoeff(), 1e-6 * w) << frequency;
    EXPECT_LT((table.accelerations.col(0).array() + gain * w * w * phase.sin()).abs().maxCoeff(), 2e-6 * w * w)
        << frequency;
    EXPECT_LT((table.torques.col(0).array() - gain * phase.cos()).abs().maxCoeff(), 1e-6) << frequency;
  }
  EXPECT_NEAR(gain_of(10.0, width), std::sqrt(0.5), 1e-12);
}

TEST(Signals, PolynomialsUpToTheDegreeThatTheGainIsFlatForComeOutExactly) {
  const auto position = [](double t) { return 1.0 + t - 2.0 * std::pow(t, 2) + std::pow(t, 5) - 0.3 * std::pow(t, 7); };
  const auto velocity = [](double t) { return 1.0 - 4.0 * t + 5.0 * std::pow(t, 4) - 2.1 * std::pow(t, 6); };
  const auto acceleration = [](double t) { return -4.0 + 20.0 * std::pow(t, 3) - 12.6 * std::pow(t, 5); };
  const Signals table = signals(log_of(1001, 500.0, position, position), all_rows);
  ASSERT_GT(table.time.size(), 20);
  for (Eigen::Index i = 0; i < table.time.size(); ++i) {
    EXPECT_NEAR(table.positions(i, 0), position(table.time(i)), 1e-6);
    EXPECT_NEAR(table.velocities(i, 0), velocity(table.time(i)), 1e-5);
    EXPECT_NEAR(table.accelerations(i, 0), acceleration(table.time(i)), 1e-3);
  }
}

TEST(Signals, LinearRelationsHoldBetweenTheColumns) {
  // u = 2 ddq + 0.7 dq + 5 q of a chirp that reaches beyond the cutoff.
  const auto phase = [](double t) { return 2.0 * pi * (0.5 * t + 0.9 * t * t); };
  const auto rate = [](double t) { return 2.0 * pi * (0.5 + 1.8 * t); };
  const auto position = [&](double t) { return std::sin(phase(t)); };
  const auto torque = [&](double t) {
    const double ddq = std::cos(phase(t)) * 2.0 * pi * 1.8 - std::sin(phase(t)) * rate(t) * rate(t);
    return 2.0 * ddq + 0.7 * std::cos(phase(t)) * rate(t) + 5.0 * std::sin(phase(t));
  };
  const Signals table = signals(log_of(8000, 1000.0, position, torque), all_rows);
  const Eigen::VectorXd sum = 2.0 * table.accelerations + 0.7 * table.velocities + 5.0 * table.positions;
  EXPECT_LT((sum - table.torques).cwiseAbs().maxCoeff(), 1e-5 * table.torques.cwiseAbs().maxCoeff());
}

TEST(Signals, WhiteNoiseHasTheVarianceOfTheEquation) {
  const double width = width_for(10.0);
  llmt::Random random(3);
  const double step = 0.002;
  const auto noise = [&](double) { return 1e-3 * random.normal(); };
  SignalsOptions options = all_rows;
  options.standstill = {};  // nothing moves: no row is left out
  options.independent = true;
  const Signals table = signals(log_of(100000, 500.0, noise, noise), options);
  EXPECT_FALSE(table.moves[0]);
  EXPECT_EQ(table.standing, 0);
  const Eigen::MatrixXd* columns[] = {&table.positions, &table.velocities, &table.accelerations};
  const double said[] = {table.position_noise[0].in_table, table.position_noise[0].of_velocity,
                         table.position_noise[0].of_acceleration};
  // Rows are nearly independent: the standard deviation of n has a relative error of 1/sqrt(2 n), 1.5 % here.
  const double error = 1.0 / std::sqrt(2.0 * static_cast<double>(table.time.size()));
  for (int power = 0; power < 3; ++power) {
    const double expected = 1e-3 * std::sqrt(step * integral(width, power, 2));
    EXPECT_NEAR(columns[power]->norm() / std::sqrt(table.time.size()), expected, 4.0 * error * expected) << power;
    EXPECT_NEAR(said[power], expected, 0.05 * expected) << power;  // the estimate of 1e-3 is that of the log
  }
  EXPECT_NEAR(table.position_noise[0].in_log, 1e-3, 3e-5);
  EXPECT_NEAR(table.torque_noise[0].in_log, 1e-3, 3e-5);
  // Rows as far apart as the noise takes, by the sum of squared correlations.
  const double apart = integral(width, 0, 4) / std::pow(integral(width, 0, 2), 2);
  EXPECT_EQ(table.every, std::lround(apart / step));
  const Eigen::Index m = table.time.size() - 1;
  const double correlation =
      table.positions.col(0).head(m).dot(table.positions.col(0).tail(m)) / table.positions.squaredNorm();
  EXPECT_NEAR(correlation, table.correlation, 4.0 / std::sqrt(m));
}

TEST(Signals, NoiseIsToldFromTheMotion) {
  for (const std::uint64_t seed : {1, 2, 3, 4, 5}) {
    llmt::Random random(seed);
    const auto position = [&](double t) {
      return std::sin(2.0 * pi * t) + 0.3 * std::sin(2.0 * pi * 4.0 * t) + 1e-4 * random.normal();
    };
    const auto torque = [&](double t) { return 5.0 * (std::sin(pi * t) > 0.0) + 0.2 * random.normal(); };
    const Signals table = signals(log_of(10000, 500.0, position, torque), {.cutoff = 10.0});
    EXPECT_NEAR(table.position_noise[0].in_log, 1e-4, 5e-6);
    EXPECT_NEAR(table.torque_noise[0].in_log, 0.2, 0.02);  // of the parts of the log a third has jumps
  }
}

// Noise with a memory is strongest below the cutoff, where the motion hides it. What is left of it in the table is said
// to a factor of 1.7 where its corner, 1 / (2 pi memory), is not above the cutoff.
TEST(Signals, NoiseWithAMemoryIsToldByItsRise) {
  for (const double memory : {0.016, 0.03}) {
    for (const std::uint64_t seed : {1, 2, 3}) {
      llmt::Random random(seed);
      const double keep = std::exp(-0.002 / memory);
      double slow = random.normal();
      const auto noise = [&](double) {
        slow = keep * slow + std::sqrt(1.0 - keep * keep) * random.normal();
        return 0.2 * slow;
      };
      const auto still = [](double) { return 0.0; };
      const Signals table = signals(log_of(20000, 500.0, still, noise), {.cutoff = 10.0, .standstill = {0.0}});
      const Eigen::VectorXd left = table.torques.col(0).array() - table.torques.col(0).mean();
      const double ratio = table.torque_noise[0].in_table / (left.norm() / std::sqrt(static_cast<double>(left.size())));
      EXPECT_GT(ratio, 1.0 / 1.7) << memory;
      EXPECT_LT(ratio, 1.7) << memory;
    }
  }
}

TEST(Signals, RowsAtStandstillAndReversalAreLeftOut) {
  llmt::Random random(1);
  const auto moves_and_rests = [&](double t) {
    return (t < 5.0 ? 1.0 - std::cos(2.0 * pi * 0.8 * t) : 0.0) + 1e-5 * random.normal();
  };
  const Log log = log_of(5000, 500.0, moves_and_rests, moves_and_rests);
  const Signals table = signals(log, {.cutoff = 10.0, .independent = true});
  ASSERT_TRUE(table.moves[0]);
  EXPECT_GT(table.lobe, 0.0);
  EXPECT_NEAR(table.standstill[0], 4.0 * table.position_noise[0].of_velocity, 1e-12);
  for (Eigen::Index i = 0; i < table.time.size(); ++i) {
    EXPECT_LT(table.time(i), 5.0 + table.half_length);
    EXPECT_GE(std::abs(table.velocities(i, 0)), table.standstill[0]);
    EXPECT_GE(std::abs(table.velocities(i, 0)), table.lobe * std::abs(table.accelerations(i, 0)));
  }
  // Nobody leaves rows out that the caller wants.
  const Signals all = signals(log, all_rows);
  EXPECT_EQ(all.time.size(), table.time.size() + table.standing);
  const Signals given = signals(log, {.cutoff = 10.0, .standstill = {0.5}});
  EXPECT_EQ(given.time.size(), (all.velocities.array().abs() >= 0.5).count());
  EXPECT_EQ(given.lobe, 0.0);
}

// Filtered at the dense rows again, a cosine has the gain of the filter once more, and white noise in them is that of
// the whole log.
TEST(Signals, RowsAreDenseEnoughToFilterASimulationAlike) {
  const double width = width_for(10.0);
  const auto position = [](double t) { return std::cos(2.0 * pi * 4.0 * t); };
  const Signals dense = signals(log_of(5000, 500.0, position, position), {.cutoff = 10.0});
  const Signals independent = signals(log_of(5000, 500.0, position, position), {.cutoff = 10.0, .independent = true});
  EXPECT_TRUE(dense.dense);
  EXPECT_FALSE(independent.dense);
  EXPECT_EQ(dense.standing, 0);
  EXPECT_EQ(dense.every, independent.every / 12);
  const Eigen::VectorXd weights = low_pass(10.0, static_cast<double>(dense.every) * dense.step);
  const Eigen::Index middle = dense.time.size() / 2;
  const double filtered = weights.dot(dense.positions.col(0).segment(middle - weights.size() / 2, weights.size()));
  EXPECT_NEAR(filtered, gain_of(4.0, width) * dense.positions(middle, 0), 1e-4);
}

TEST(Signals, APositionThatNeverMovesLeavesNothingOut) {
  Log log = log_of(
      5000, 500.0, [](double t) { return std::sin(t); }, [](double) { return 1.0; });
  log.positions.conservativeResize(Eigen::NoChange, 2);
  log.positions.col(1).setConstant(1.3);
  const Signals table = signals(log, {.cutoff = 10.0, .independent = true});
  EXPECT_TRUE(table.moves[0]);
  EXPECT_FALSE(table.moves[1]);
  EXPECT_GT(table.time.size(), 100);
}

TEST(Signals, GapsAndRunsAreFilteredByThemselves) {
  const auto wave = [](double t) { return std::sin(3.0 * t) + 0.2 * std::cos(11.0 * t); };
  const Log whole = log_of(4000, 500.0, wave, wave);
  const auto part = [&](Eigen::Index first, Eigen::Index rows) {
    return Log{whole.time.segment(first, rows), whole.positions.middleRows(first, rows),
               whole.torques.middleRows(first, rows)};
  };
  const Signals one = signals(part(0, 1500), all_rows);
  const Signals other = signals(part(2200, 1800), all_rows);
  Log gap = part(0, 3300);
  gap.time.segment(1500, 1800) = whole.time.tail(1800);
  gap.positions.middleRows(1500, 1800) = whole.positions.bottomRows(1800);
  gap.torques.middleRows(1500, 1800) = whole.torques.bottomRows(1800);
  Log runs = gap;
  runs.time.segment(1500, 1800).array() -= whole.time(2200);  // time begins anew
  for (Eigen::Index i = 0; i < 3300; ++i) runs.runs.push_back(i < 1500 ? "b" : "a");
  for (const Log& log : {gap, runs}) {
    const Signals both = signals(log, all_rows);
    ASSERT_EQ(both.stretches.size(), 2U);
    ASSERT_EQ(both.time.size(), one.time.size() + other.time.size());
    EXPECT_LT((both.accelerations.topRows(one.time.size()) - one.accelerations).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_LT((both.accelerations.bottomRows(other.time.size()) - other.accelerations).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_EQ(both.stretches[1].first, 1500);
    EXPECT_EQ(both.stretches[1].kept, other.time.size());
    EXPECT_EQ(both.rows.back(), 3299 - (1799 - other.rows.back()));
  }
  EXPECT_EQ(signals(runs, all_rows).stretches[0].run, "b");
}

TEST(Signals, JitterAndLostSamplesAreInterpolated) {
  llmt::Random random(7);
  const auto wave = [](double t) { return std::sin(2.0 * pi * t); };
  Log log = log_of(5000, 500.0, wave, wave);
  std::vector<double> times;
  for (Eigen::Index i = 0; i < log.time.size(); ++i) {
    if (i % 100 == 50) continue;  // lost
    times.push_back(log.time(i) + 0.0004 * (random.uniform() - 0.5));
  }
  log.time = Eigen::Map<Eigen::VectorXd>(times.data(), std::ssize(times));
  log.positions = log.time.unaryExpr(wave);
  log.torques = log.positions;
  const Signals table = signals(log, all_rows);
  EXPECT_TRUE(table.resampled);
  EXPECT_EQ(table.stretches.size(), 1U);
  const double gain = gain_of(1.0, width_for(10.0));
  const Eigen::ArrayXd phase = 2.0 * pi * table.time.array();
  EXPECT_LT((table.accelerations.col(0).array() + gain * 4.0 * pi * pi * phase.sin()).abs().maxCoeff(), 1e-3);
}

TEST(Signals, TimesThatWereRoundedAreEven) {
  // 400 Hz with three decimals: steps of 2 and 3 ms.
  const auto wave = [](double t) { return std::sin(2.0 * pi * t); };
  Log log = log_of(4000, 400.0, wave, wave);
  const Signals even = signals(log, all_rows);
  log.time = (log.time.array() * 1000.0 + 1e-9).round() / 1000.0;
  const Signals rounded = signals(log, all_rows);
  EXPECT_FALSE(rounded.resampled);
  EXPECT_NEAR(rounded.step, 0.0025, 1e-6);
  ASSERT_EQ(rounded.time.size(), even.time.size());
  EXPECT_LT((rounded.accelerations - even.accelerations).cwiseAbs().maxCoeff(), 0.02);
}

TEST(Signals, WhatCannotBeUsedIsRefusedWithItsRow) {
  const auto wave = [](double t) { return std::sin(t); };
  const Log good = log_of(2000, 500.0, wave, wave);
  const auto row_of = [](const Log& log, const SignalsOptions& options) -> Eigen::Index {
    try {
      signals(log, options);
    } catch (const LogError& error) {
      return error.row();
    }
    ADD_FAILURE() << "nothing was thrown";
    return -2;
  };
  Log log = good;
  log.time(700) = log.time(699);
  EXPECT_EQ(row_of(log, all_rows), 700);
  log = good;
  log.positions(31, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(row_of(log, all_rows), 31);
  log = good;
  log.runs.assign(2000, "a");
  std::fill(log.runs.begin() + 1000, log.runs.begin() + 1500, "b");
  EXPECT_EQ(row_of(log, all_rows), 1500);
  log = good;
  for (Eigen::Index i = 1000; i < 2000; ++i) log.time(i) = log.time(i - 1) + (i % 3 == 0 ? 0.0041 : 0.002);
  EXPECT_EQ(row_of(log, all_rows), 1002);
  EXPECT_EQ(row_of(good, {.cutoff = 0.0}), -1);
  EXPECT_EQ(row_of(good, {.cutoff = 126.0}), -1);
  EXPECT_NO_THROW(signals(good, {.cutoff = 125.0}));
  EXPECT_EQ(row_of(good, {.cutoff = 1.0}), 0);  // 4 s, of which the filter takes 5.2
  EXPECT_EQ(row_of(good, {.cutoff = 10.0, .standstill = {0.1, 0.2}}), -1);
  EXPECT_EQ(row_of(good, {.cutoff = 10.0, .standstill = {-0.1}}), -1);
  EXPECT_EQ(row_of(good, {.cutoff = 10.0, .standstill = {0.1}, .every = -1}), -1);
  EXPECT_EQ(row_of({}, all_rows), -1);
  log = good;
  log.torques.conservativeResize(1999, Eigen::NoChange);
  EXPECT_EQ(row_of(log, all_rows), -1);
  log.torques.resize(2000, 0);
  EXPECT_EQ(signals(log, all_rows).torques.cols(), 0);
}

}  // namespace
}  // namespace signals_test
