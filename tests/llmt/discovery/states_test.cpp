// States that the inputs do not show, in filtered logs: what follows them slowly, and what swings behind them.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>

#include "discovery/terms/term_builders.hpp"
#include "filtered_log.hpp"

namespace states_test {
namespace {

using namespace log_test;

// dz/dt = derivative(t, z) at t from z at 0, by Runge's and Kutta's method.
double integrated(const std::function<double(double, double)>& derivative, double z, double t) {
  constexpr int steps = 4000;
  const double h = t / steps;
  for (int k = 0; k < steps; ++k) {
    const double now = k * h;
    const double a = derivative(now, z);
    const double b = derivative(now + 0.5 * h, z + 0.5 * h * a);
    const double c = derivative(now + 0.5 * h, z + 0.5 * h * b);
    const double d = derivative(now + h, z + h * c);
    z += h / 6.0 * (a + 2.0 * b + 2.0 * c + d);
  }
  return z;
}

TEST(Lagged, IsTheSolutionForStraightLinesBetweenRows) {
  constexpr double tau = 0.7;
  Inputs inputs{{"x"}, Eigen::VectorXd(4)};
  inputs.instants = Eigen::Vector4d(0.0, 0.3, 1.7, 2.0);
  const Eigen::VectorXd x = Eigen::Vector4d(1.0, -0.5, 2.0, 2.2);
  inputs.values = x;
  const auto line = [&](double t) {
    Eigen::Index k = 0;
    while (k < 2 && t > inputs.instants(k + 1)) ++k;
    const double share = (t - inputs.instants(k)) / (inputs.instants(k + 1) - inputs.instants(k));
    return x(k) + share * (x(k + 1) - x(k));
  };
  for (const bool settled : {true, false}) {
    const Eigen::VectorXd z = lagged(rows_of(inputs, x), x, tau, settled);
    for (Eigen::Index i = 0; i < 4; ++i) {
      const double start = settled ? x(0) : 0.0;
      const auto derivative = [&](double t, double own) { return (line(t) - own) / tau; };
      EXPECT_NEAR(z(i), integrated(derivative, start, inputs.instants(i)), 1e-6);
    }
  }
}

TEST(Lagged, BeginsAnewWithEveryRun) {
  Inputs inputs{{"x"}, Eigen::VectorXd::LinSpaced(6, 1.0, 6.0)};
  inputs.instants = Eigen::VectorXd(6);
  inputs.instants << 0.0, 1.0, 2.0, 0.0, 1.0, 2.0;
  inputs.runs = {0, 0, 0, 1, 1, 1};
  const Eigen::VectorXd x = inputs.values.col(0);
  EXPECT_EQ(lagged(rows_of(inputs, x), x, 1.0, true)(3), 4.0);
  EXPECT_EQ(lagged(rows_of(inputs, x), x, 1.0, false)(3), 0.0);
}

// Friction that falls as its losses warm it up.
TEST(States, WarmthIsNamedWithItsTimeConstant) {
  constexpr double tau = 4.0;
  constexpr double strength = -0.3;
  const Model model{.dry = 1.0};
  std::vector<double> warmth = {0.0};
  for (Eigen::Index i = 1; i < samples; ++i) {
    const double square = std::pow(motion((static_cast<double>(i) - 0.5) / rate)(1), 2.0);
    warmth.push_back(square + (warmth.back() - square) * std::exp(-1.0 / (rate * tau)));
  }
  const Missing missing = missing_from(rows_of_log(1, model, 0.05, [&](double t) {
    const Eigen::Vector3d x = motion(t);
    return model.torque(x) + strength * warmth.at(static_cast<std::size_t>(std::lround(t * rate))) * x(1);
  }));
  EXPECT_EQ(missing.answer, Answer::inner_state);
  ASSERT_EQ(missing.found.size(), 1u);
  EXPECT_EQ(missing.found[0].family + " " + missing.found[0].location, "warming dq");
  EXPECT_NEAR(missing.found[0].coefficients(0), strength, 0.05 * std::abs(strength));
  EXPECT_NEAR(missing.found[0].constants(0), tau, 0.1 * tau);
}

// A load on a pendulum, of which the simulation knows the mass alone: at a frequency w of the motion it takes up
// m w_0^2 / (w_0^2 - w^2) of what it would if it were fixed (without damping).
TEST(States, ASwingingLoadIsNamedWithItsFrequency) {
  constexpr double mass = 0.1;
  constexpr double own = 2.9;  // rad/s, among the frequencies of the motion
  const Model model{.dry = 1.0};
  const auto swung = [&](double t) {
    double sum = 0.0;
    double phase = 0.3;
    for (const double w : {1.1, 2.3, 3.7}) {
      sum += own * own / (own * own - w * w) * -0.9 * w * std::sin(w * t + phase);
      phase += 1.9;
    }
    return sum;
  };
  const Missing missing = missing_from(rows_of_log(
      1, model, 0.02, [&](double t) { return model.torque(motion(t)) + mass * (swung(t) - motion(t)(2)); }));
  EXPECT_EQ(missing.answer, Answer::inner_state);
  ASSERT_FALSE(missing.found.empty());
  EXPECT_EQ(missing.found[0].family + " " + missing.found[0].location, "resonance ddq");
  EXPECT_NEAR(missing.found[0].constants(0) * 2.0 * std::numbers::pi, own, 0.05 * own);
}

// The log holds the command u + tau du/dt of a slow actuator. A delay is not the same: it has no second order.
TEST(States, AnActuatorIsALead) {
  constexpr double tau = 0.12;
  const Model model;
  const auto torque = [&](double t) { return model.torque(motion(t)); };
  const Missing missing = missing_from(rows_of_log(1, model, 0.02, [&](double t) {
    constexpr double h = 1e-4;
    return torque(t) + tau * (torque(t + h) - torque(t - h)) / (2.0 * h);
  }));
  EXPECT_EQ(missing.answer, Answer::inner_state);
  ASSERT_EQ(missing.found.size(), 1u);
  EXPECT_EQ(missing.found[0].family, "lag");
  EXPECT_NEAR(missing.found[0].constants(0), -tau, 0.02 * tau);
}

// An inner state is none where friction, gravity and an offset are missing.
TEST(States, WhatIsStaticIsNoState) {
  const Model model;
  const Missing missing = missing_from(rows_of_log(2, model, 0.05, [&](double t) {
    const Eigen::Vector3d x = motion(t);
    return model.torque(x) + 0.4 * std::tanh(x(1) / 0.2);
  }));
  ASSERT_EQ(missing.found.size(), 1u);
  EXPECT_TRUE(missing.found[0].inner_state.empty()) << missing.found[0].family;
}

}  // namespace
}  // namespace states_test
