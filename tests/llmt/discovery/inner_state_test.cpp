#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "discovery/recording/derivatives.hpp"
#include "discovery/terms/term_builders.hpp"
#include "llmt/discovery/simulation.hpp"
#include "noise.hpp"
#include "study.hpp"

namespace inner_state_test {
namespace {

using namespace llmt::discovery;

constexpr Eigen::Index rows = 1000;
constexpr double step = 0.02;                                                 // s
constexpr std::array<double, 5> frequencies = {0.08, 0.17, 0.31, 0.53, 0.8};  // Hz
constexpr std::array<double, 5> sizes = {0.4, 0.3, 0.25, 0.2, 0.15};

/// Sum over the sines of size * factor(omega) * sin(omega t + phase), differentiated `order` times.
template <class Factor>
double motion(double t, int order, const Factor& factor) {
  double sum = 0.0;
  for (std::size_t k = 0; k < frequencies.size(); ++k) {
    const double omega = 2.0 * std::numbers::pi * frequencies[k];
    const double phase = 0.7 * static_cast<double>(k) + 0.5 * std::numbers::pi * order;
    sum += sizes[k] * factor(omega) * std::pow(omega, order) * std::sin(omega * t + phase);
  }
  return sum;
}

double one(double) { return 1.0; }

struct Log {
  Inputs inputs{{"q", "dq", "ddq"}, Eigen::MatrixXd(rows, 3)};
  Eigen::MatrixXd simulated{Eigen::MatrixXd(rows, 1)};
  MeasuredOutputs measured{{"u"}, Eigen::MatrixXd(rows, 1)};

  Log() { inputs.instants = Eigen::VectorXd::LinSpaced(rows, 0.0, step * static_cast<double>(rows - 1)); }
};

constexpr double inertia = 3.0;
constexpr double damping = 1.0;
constexpr double gravity = 40.0;

/// `torque(t)` is what is measured; the nominal model is inertia ddq + damping dq + gravity q.
template <class Torque>
Log log_of(std::uint64_t seed, double noise, const Torque& torque) {
  Noise random(seed);
  Log log;
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double t = log.inputs.instants(i);
    for (int order = 0; order < 3; ++order) log.inputs.values(i, order) = motion(t, order, one);
    log.simulated(i, 0) = log.inputs.values.row(i).dot(Eigen::RowVector3d(gravity, damping, inertia));
    log.measured.values(i, 0) = torque(t) + noise * random.normal();
  }
  return log;
}

double nominal(double t) {
  return inertia * motion(t, 2, one) + damping * motion(t, 1, one) + gravity * motion(t, 0, one);
}

Missing missing_from(const Log& log) {
  std::vector<ModelTerm> terms = standard_terms(log.inputs);
  for (ModelTerm& term : inner_state_terms(log.inputs, log.simulated, {"u"})) terms.push_back(std::move(term));
  return find_missing(tabulated(log.simulated, {"u"}), log.inputs, log.measured, terms);
}

TEST(InnerState, DelayIsMeasured) {
  // A command is ahead of the torque. With 0.3 s the first term of the series would miss a third of the gap.
  const std::vector<double> delays = {0.004, -0.004, 0.3, -0.3};
  for (std::size_t k = 0; k < delays.size(); ++k) {
    const double delay = delays[k];
    const Missing missing = missing_from(log_of(k + 1, 0.1, [&](double t) { return nominal(t - delay); }));
    EXPECT_EQ(missing.answer, Answer::inner_state) << delay;
    ASSERT_EQ(missing.found.size(), 1u) << delay << " gain " << missing.verdict.score_gain;
    EXPECT_EQ(missing.found.front().family, "delay");
    EXPECT_EQ(missing.found.front().values.front().unit, "units of time");
    EXPECT_EQ(missing.found.front().coefficients(0), 1.0);  // all of the simulated output is late
    const TermValue& found = missing.found.front().values.front();
    EXPECT_NEAR(found.value, delay, 4.0 * found.standard_error);
  }
}

TEST(InnerState, MachineWithoutOneHasNone) {
  const std::uint64_t seeds = sampled(5, 1);
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    EXPECT_EQ(missing_from(log_of(seed, 0.1, nominal)).answer, Answer::nothing_missing);
    const auto heavier = [](double t) { return nominal(t) + 0.3 * motion(t, 2, one); };
    const Missing missing = missing_from(log_of(seed, 0.1, heavier));
    ASSERT_EQ(missing.found.size(), 1u);
    EXPECT_TRUE(missing.found.front().inner_state.empty()) << missing.found.front().family;
  }
}

// A rotor of 20 % of the inertia drives the load through a spring: at each frequency the load moves by
// k / (k + gravity - load omega^2) of the rotor (without damping), and u = rotor ddq + damping dq + k (q - q_load).
TEST(InnerState, SpringInTheDriveIsMeasured) {
  constexpr double rate = 1500.0;
  constexpr double rotor = 0.2 * inertia;
  constexpr double load = inertia - rotor;
  const auto twist = [](double omega) { return 1.0 - rate / (rate + gravity - load * omega * omega); };
  const Missing missing = missing_from(log_of(1, 0.02, [&](double t) {
    return rotor * motion(t, 2, one) + damping * motion(t, 1, one) + rate * motion(t, 0, twist);
  }));
  EXPECT_EQ(missing.answer, Answer::inner_state);
  ASSERT_FALSE(missing.found.empty());
  EXPECT_EQ(missing.found.front().family, "drive_spring");
  EXPECT_EQ(missing.found.front().location, "q");
  constexpr double of_second_order = 0.15;
  EXPECT_NEAR(missing.found.front().coefficients(0) * rate, 1.0, of_second_order);
}

/// s - H s, by Runge's and Kutta's method in 40 steps a row.
template <class Signal>
Eigen::VectorXd integrated(const Eigen::VectorXd& instants, double omega, double zeta, const Signal& signal) {
  const auto derivative = [&](double t, const Eigen::Vector2d& x) {
    return Eigen::Vector2d(x(1), signal(t) - 2.0 * zeta * omega * x(1) - omega * omega * x(0));
  };
  constexpr int steps = 40;
  Eigen::Vector2d x(signal(instants(0)) / (omega * omega), 0.0);
  Eigen::VectorXd part(instants.size());
  for (Eigen::Index i = 0; i < instants.size(); ++i) {
    part(i) = derivative(instants(i), x)(1);
    if (i + 1 == instants.size()) break;
    const double h = (instants(i + 1) - instants(i)) / steps;
    for (int k = 0; k < steps; ++k) {
      const double t = instants(i) + k * h;
      const Eigen::Vector2d a = derivative(t, x);
      const Eigen::Vector2d b = derivative(t + 0.5 * h, x + 0.5 * h * a);
      const Eigen::Vector2d c = derivative(t + 0.5 * h, x + 0.5 * h * b);
      const Eigen::Vector2d d = derivative(t + h, x + h * c);
      x += h / 6.0 * (a + 2.0 * b + 2.0 * c + d);
    }
  }
  return part;
}

// Straight lines between rows that are not equally spaced: the integral is exact but for that of the oracle.
TEST(InnerState, ResonantPartIsThatOfAnIntegratedOscillator) {
  Noise random(2);
  constexpr Eigen::Index count = 200;
  Eigen::VectorXd instants(count);
  Eigen::VectorXd values(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    instants(i) = 0.02 * (static_cast<double>(i) + 0.6 * random.uniform());
    values(i) = random.normal();
  }
  const auto between = [&](double t) {
    const Eigen::Index above =
        std::clamp<Eigen::Index>(std::ranges::upper_bound(instants, t) - instants.begin(), 1, count - 1);
    const double share = (t - instants(above - 1)) / (instants(above) - instants(above - 1));
    return values(above - 1) + share * (values(above) - values(above - 1));
  };
  Inputs inputs{{"t"}, instants};
  inputs.instants = instants;
  for (const double zeta : {0.02, 0.3, 0.9}) {
    const double omega = 2.0 * std::numbers::pi * 4.0;
    const Eigen::VectorXd expected = integrated(instants, omega, zeta, between);
    EXPECT_LT((resonant_part(rows_of(inputs, values), values, 4.0, zeta) - expected).cwiseAbs().maxCoeff(), 1e-6);
  }
}

TEST(InnerState, ResonantPartBeginsAtRestAfterALongInterruption) {
  Inputs inputs{{"t"}, Eigen::VectorXd::LinSpaced(100, 0.0, 1.98)};
  inputs.instants = inputs.values.col(0);
  inputs.instants.tail(50).array() += 10.0;
  const Eigen::VectorXd values = inputs.instants.array().square().matrix();
  const Eigen::VectorXd part = resonant_part(rows_of(inputs, values), values, 2.0, 0.1);
  EXPECT_EQ(part(0), 0.0);
  EXPECT_NEAR(part(50), 0.0, 1e-12 * values(50));
  EXPECT_GT(std::abs(part(60)), 1e-4);
}

// Dry friction makes a load of 60 % of the torque ring behind its spring at each reversal.
TEST(InnerState, ResonanceIsMeasured) {
  constexpr double share = 0.6;
  constexpr double frequency = 6.0;
  constexpr double zeta = 0.08;
  const auto torque = [](double t) { return nominal(t) + (motion(t, 1, one) < 0.0 ? -8.0 : 8.0); };
  for (const std::uint64_t seed : {1u, 2u}) {
    Log log = log_of(seed, 0.2, torque);
    for (Eigen::Index i = 0; i < rows; ++i) log.simulated(i, 0) = torque(log.inputs.instants(i));
    const double omega = 2.0 * std::numbers::pi * frequency;
    log.measured.values.col(0) -= share * integrated(log.inputs.instants, omega, zeta, torque);
    const Missing missing = missing_from(log);
    EXPECT_EQ(missing.answer, Answer::inner_state);
    ASSERT_FALSE(missing.found.empty());
    const FoundTerm& found = missing.found.front();
    EXPECT_EQ(found.family, "resonance");
    EXPECT_NEAR(found.coefficients(0), share, 0.1);
    EXPECT_NEAR(found.constants(0), frequency, 0.1);
    EXPECT_NEAR(found.constants(1), zeta, 0.02);
    EXPECT_LT(missing.gaps.front().after, 0.4 * missing.gaps.front().before);
  }
}

TEST(InnerState, ACorrectionThatMakesTheGapLargerIsWorse) {
  const auto missing_with = [](std::vector<std::pair<double, double>> gaps) {
    Missing missing;
    for (const auto& [before, after] : gaps) {
      missing.gaps.push_back({.output = "u", .before = before, .after = after, .noise_floor = 0.1});
    }
    missing.found.resize(1);
    return missing;
  };
  EXPECT_FALSE(is_worse(missing_with({{0.5, 0.5}})));
  Missing nothing = missing_with({{0.5, 0.6}});
  nothing.found.clear();
  EXPECT_FALSE(is_worse(nothing));  // there is nothing to leave out
  EXPECT_FALSE(is_worse(missing_with({{0.5, 0.4}})));
  EXPECT_TRUE(is_worse(missing_with({{0.5, 0.6}})));
  EXPECT_TRUE(is_worse(missing_with({{0.0, 0.1}})));
  EXPECT_FALSE(
      is_worse(missing_with({{0.5, 0.55}, {100.0, 20.0}})));  // outputs count by their gaps, whatever their unit
  EXPECT_TRUE(is_worse(missing_with({{0.5, 1.0}, {100.0, 20.0}})));
  Missing failed = missing_with({{0.5, 0.4}});
  failed.answer = Answer::failed_held_out;
  EXPECT_TRUE(is_worse(failed));
  // What was fitted to these rows is not to be added to others where the answer does not stand for it.
  EXPECT_FALSE(may_be_applied(failed));
  Missing better = missing_with({{0.5, 0.4}});
  better.gaps[0].nominal = 1.0;
  for (const Answer answer : {Answer::named, Answer::indistinguishable, Answer::unknown, Answer::parameters_only,
                              Answer::inner_state, Answer::nothing_missing, Answer::undecided}) {
    better.answer = answer;
    EXPECT_EQ(may_be_applied(better), answer != Answer::nothing_missing);
  }
  // Beside something unknown they must take away more than they leave: half of the squares.
  for (const double after : {0.7, 0.72}) {
    better.gaps[0].after = after;
    better.gaps[0].before = 0.9;
    for (const Answer answer : {Answer::undecided, Answer::unknown, Answer::indistinguishable, Answer::inner_state}) {
      better.answer = answer;
      const bool is_known = answer == Answer::indistinguishable || answer == Answer::inner_state;
      EXPECT_EQ(may_be_applied(better), after < 0.71 || is_known);
      // An output that nothing is added to says nothing of it.
      better.gaps.push_back({.output = "other", .before = 1.0, .after = 1.0, .nominal = 1.0});
      EXPECT_EQ(may_be_applied(better), after < 0.71 || is_known);
      better.gaps.pop_back();
    }
  }
  Missing worse = missing_with({{0.5, 0.6}});
  worse.answer = Answer::named;
  EXPECT_FALSE(may_be_applied(worse));
  // Parameters alone are judged against the simulation as it was given.
  worse.answer = Answer::parameters_only;
  worse.gaps[0].nominal = 2.0;
  EXPECT_TRUE(may_be_applied(worse));
  worse.gaps[0].nominal = 0.55;
  EXPECT_FALSE(may_be_applied(worse));
}

// The filter of a recording: a resonance of so much damping is none. One log: others would differ by noise alone, which
// is a fortieth of the friction.
TEST(InnerState, WhatHardlyRingsIsNoResonance) {
  const auto torque = [](double t) { return nominal(t) + (motion(t, 1, one) < 0.0 ? -8.0 : 8.0); };
  Log log = log_of(1, 0.2, torque);
  for (Eigen::Index i = 0; i < rows; ++i) log.simulated(i, 0) = torque(log.inputs.instants(i));
  log.measured.values.col(0) -= 0.6 * integrated(log.inputs.instants, 2.0 * std::numbers::pi * 6.0, 0.6, torque);
  for (const FoundTerm& found : missing_from(log).found) EXPECT_NE(found.family, "resonance");
}

TEST(InnerState, DerivativesOfPolynomialsAreExact) {
  Inputs inputs{{"t"}, Eigen::MatrixXd(50, 1)};
  Noise random(1);
  for (Eigen::Index i = 0; i < 50; ++i) {
    inputs.values(i, 0) = 0.1 * (static_cast<double>(i) + 0.3 * random.uniform());  // not equally spaced
  }
  inputs.instants = inputs.values.col(0);
  const Eigen::ArrayXd t = inputs.values.col(0).array();
  const Derivatives derivatives(rows_of(inputs, Eigen::VectorXd::Zero(50)), 4);
  const Eigen::VectorXd values = (t.pow(4.0) - 2.0 * t.cube() + t).matrix();
  const Eigen::VectorXd first = derivatives.first(values);
  const Eigen::VectorXd second = derivatives.second(values);
  for (Eigen::Index i = 4; i < 46; ++i) {  // whole windows
    EXPECT_NEAR(first(i), 4.0 * std::pow(t(i), 3.0) - 6.0 * t(i) * t(i) + 1.0, 1e-6);
    EXPECT_NEAR(second(i), 12.0 * t(i) * t(i) - 12.0 * t(i), 1e-4);
  }
}

}  // namespace
}  // namespace inner_state_test
