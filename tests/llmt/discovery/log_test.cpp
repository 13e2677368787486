// From a raw log to an answer: rows by signals(), a simulation at them, find_missing().
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <stdexcept>
#include <string>

#include "discovery/answer/question.hpp"
#include "discovery/recording/recording.hpp"
#include "discovery/signals/kernel.hpp"
#include "filtered_log.hpp"
#include "llmt/discovery/search.hpp"
#include "study.hpp"

namespace log_test {
namespace {

TEST(FilteredRows, AreWeightedSumsThatEndWhereTheRecordingDoes) {
  constexpr Eigen::Index n = 60;
  Inputs inputs{{"x"}, Eigen::VectorXd::LinSpaced(n, 0.0, 1.0)};
  inputs.instants = Eigen::VectorXd::LinSpaced(n, 0.0, n - 1.0);
  inputs.instants.tail(20).array() += 5.0;  // a gap before row 40
  inputs.cutoff = 0.05;
  const Recording recording(inputs);
  const RowFilter& filter = recording.filter();
  ASSERT_EQ(filter.pieces().size(), 2u);
  EXPECT_NEAR(filter.weights().sum(), 1.0, 1e-12);
  Eigen::VectorXd values(n);
  for (Eigen::Index i = 0; i < n; ++i) values(i) = std::sin(0.37 * static_cast<double>(i * i));
  const Eigen::MatrixXd filtered = filter(values);
  const Eigen::Index half = filter.weights().size() / 2;
  for (Eigen::Index i = 0; i < n; ++i) {
    double sum = 0.0;
    double weight = 0.0;
    for (Eigen::Index k = -half; k <= half; ++k) {
      const Eigen::Index j = i + k;
      if (j < 0 || j >= n || (j < 40) != (i < 40)) continue;
      sum += filter.weights()(half + k) * values(j);
      weight += filter.weights()(half + k);
    }
    EXPECT_NEAR(filtered(i, 0), sum / weight, 1e-12) << i;
  }
  EXPECT_EQ(Recording({{"x"}, inputs.values}).as_measured(values), values);
}

TEST(FilteredRows, ThatAreTooFewOrTooFarApartAreRefused) {
  const Model model;
  const LogRows whole = rows_of_log(1, model, 0.05, [&](double t) { return model.torque(motion(t)); });
  const auto refusal = [&](Eigen::Index every, Eigen::Index most) {
    std::vector<Eigen::Index> kept;
    for (Eigen::Index i = 0; i < whole.simulated.rows() && std::ssize(kept) < most; i += every) kept.push_back(i);
    LogRows rows = whole;
    rows.inputs.values = whole.inputs.values(kept, Eigen::all);
    rows.inputs.instants = whole.inputs.instants(kept);
    rows.simulated = whole.simulated(kept, Eigen::all);
    rows.measured.values = whole.measured.values(kept, Eigen::all);
    try {
      find_missing(tabulated(rows.simulated, {"u"}), rows.inputs, rows.measured, standard_terms(rows.inputs));
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(refusal(20, 200).find("too far to filter the simulation"), std::string::npos);
  EXPECT_NE(refusal(1, 20).find("longer than the filter"), std::string::npos);
}

// The integral of a sign over rows is right wherever between two rows the input passes zero.
TEST(FilteredRows, AJumpBetweenRowsCountsWhereItIs) {
  for (const double place : {99.5, 99.3, 99.07, 99.9}) {
    Inputs inputs{{"x"}, Eigen::VectorXd::LinSpaced(200, 0.0, 199.0)};
    inputs.instants = inputs.values.col(0);
    inputs.values.array() -= place;
    inputs.cutoff = 0.05;
    const Recording recording(inputs);
    const RowFilter& filter = recording.filter();
    const Eigen::VectorXd sign = inputs.values.col(0).cwiseSign();
    const Eigen::VectorXd line = 3.0 * inputs.values.col(0);
    const Eigen::Index half = filter.weights().size() / 2;
    // Each row stands for half a step to either side; the step of the jump is divided where x is zero.
    double expected = 0.0;
    for (Eigen::Index k = -half; k <= half; ++k) {
      const double below = std::clamp(place - (100.0 + static_cast<double>(k) - 0.5), 0.0, 1.0);
      expected += filter.weights()(half + k) * (1.0 - 2.0 * below);
    }
    const double step = filter.weights()(half) - filter.weights()(half - 1);
    EXPECT_NEAR(filter(sign)(100, 0), expected, std::abs(step)) << place;
    EXPECT_NEAR(filter(line)(100, 0), 3.0 * (100.0 - place), 1e-9) << place;
  }
}

// Dry friction that the model has: the filter of the log rounds it at every reversal.
TEST(FilteredRows, ACompleteModelWithDryFrictionLacksNothing) {
  const Model model{.dry = 2.0};
  const auto torque = [&](double t) { return model.torque(motion(t)); };
  const std::uint64_t seeds = sampled(3, 1);
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const LogRows rows = rows_of_log(seed, model, 0.05, torque);
    const Missing missing = missing_from(rows);
    std::string found;
    for (const FoundTerm& term : missing.found) found += term.family + " " + term.location + ", ";
    EXPECT_EQ(missing.answer, Answer::nothing_missing) << seed << " " << to_string(missing.answer) << " " << found;
    EXPECT_LT(missing.gaps[0].after, 3.0 * missing.gaps[0].known_noise);
    // As they stand, the rows at reversals deviate by more than the noise.
    const Eigen::ArrayXd deviations = (rows.measured.values - rows.simulated).array();
    EXPECT_GT(deviations.abs().maxCoeff(), 20.0 * missing.gaps[0].known_noise);
  }
}

// Of a speed and an acceleration of noise, by drawing: the mean of neighbours with the weights, beside the sample
// itself after the low pass. Next to the sample alone the correlations are -.4 and -.6.
TEST(FilteredRows, NeighboursHaveOtherErrorsThanTheSample) {
  constexpr double cutoff = 10.0;
  constexpr double step = 0.002;
  llmt::Random random(5);
  Log log;
  log.time = step * Eigen::VectorXd::LinSpaced(60000, 0.0, 59999.0);
  log.positions = log.time.unaryExpr([&](double) { return random.normal(); });
  log.torques = log.positions;
  const Signals table = signals(log, {.cutoff = cutoff, .every = 1});
  const Eigen::VectorXd low = low_pass(cutoff, step);
  const Eigen::Index half = low.size() / 2;
  const Eigen::Index stride = independent_step(cutoff, step);
  const Eigen::Vector3d weights = uncorrelated_neighbours(cutoff, step, stride);
  EXPECT_NEAR(weights.sum(), 1.0, 1e-12);
  EXPECT_LT(weights.cwiseAbs().maxCoeff(), 1.0);
  const auto correlation = [&](const Eigen::VectorXd& signal, const Eigen::Vector3d& of_places) {
    double product = 0.0;
    double own = 0.0;
    double others = 0.0;
    for (Eigen::Index i = std::max(half, 3 * stride); i + std::max(half, 3 * stride) < signal.size(); ++i) {
      const double twice = low.dot(signal.segment(i - half, low.size()));
      double mean = 0.0;
      for (Eigen::Index m = 1; m <= 3; ++m) {
        mean += 0.5 * of_places(m - 1) * (signal(i - m * stride) + signal(i + m * stride));
      }
      product += twice * mean;
      own += twice * twice;
      others += mean * mean;
    }
    return product / std::sqrt(own * others);
  };
  for (const Eigen::MatrixXd* columns : {&table.velocities, &table.accelerations}) {
    EXPECT_NEAR(correlation(columns->col(0), weights), 0.0, 0.05);
    EXPECT_LT(correlation(columns->col(0), Eigen::Vector3d::UnitX()), -0.4);
  }
}

// The noise of an encoder makes the errors of its acceleration, and of the deviations that they cause, alike in
// neighbours, with changing sign. That is no structure of something that is missing. Of 14 seeds one has structure
// left.
TEST(FilteredRows, ErrorsOfDerivativesAreNoStructure) {
  const Model model;
  int cleared = 0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const auto torque = [&](double t) { return model.torque(motion(t)); };
    const Missing missing = missing_from(rows_of_log(seed, model, 0.01, torque, {.cutoff = 20.0}, motion, 1e-3));
    if (missing.answer == Answer::nothing_missing) ++cleared;
  }
  EXPECT_GE(cleared, 2);
}

TEST(FilteredRows, AStateIsFoundBesideDryFriction) {
  const Model model{.dry = 2.0};
  constexpr double delay = -0.03;  // a command, ahead of the torque
  const Missing missing =
      missing_from(rows_of_log(1, model, 0.05, [&](double t) { return model.torque(motion(t - delay)); }));
  EXPECT_EQ(missing.answer, Answer::inner_state);
  ASSERT_EQ(missing.found.size(), 1u);
  EXPECT_EQ(missing.found.front().family, "delay");
  EXPECT_NEAR(missing.found.front().values.front().value, delay, 0.002);
}

// Noise that is alike in neighbours may be as large as it likes, but not larger than what is known of it.
TEST(KnownNoise, BoundsTheAllClear) {
  const Model model;
  // A slow wave that no input follows.
  const auto torque = [&](double t) {
    return model.torque(motion(t)) + 0.6 * std::sin(5.3 * t + 2.0 * std::sin(0.7 * t));
  };
  LogRows rows = rows_of_log(1, model, 0.01, torque);
  const Missing bounded = missing_from(rows);
  EXPECT_TRUE(bounded.answer == Answer::undecided || bounded.answer == Answer::unknown) << to_string(bounded.answer);
  EXPECT_TRUE(std::ranges::none_of(bounded.found, &FoundTerm::confirmed));
  EXPECT_GT(bounded.gaps[0].after, 20.0 * bounded.gaps[0].known_noise);
  rows.measured.noise.setConstant(0.5);
  EXPECT_NE(missing_from(rows).answer, Answer::undecided);
}

// Its own constant is fitted; terms without one have found the threshold before.
TEST(Regimes, ATermWithAConstantIsNamedBeyondAThreshold) {
  const Model model;
  constexpr double threshold = 0.25;
  const auto torque = [&](double t) {
    const Eigen::Vector3d x = motion(t);
    return model.torque(x) + (x(0) > threshold ? 0.8 * std::tanh(x(1) / 0.3) : 0.0);
  };
  const Missing missing = missing_from(rows_of_log(1, model, 0.02, torque));
  ASSERT_EQ(missing.found.size(), 1u);
  const FoundTerm& found = missing.found.front();
  EXPECT_EQ(found.family, "tanh");
  EXPECT_EQ(found.location, "dq where q > c");
  ASSERT_EQ(found.constants.size(), 2);
  EXPECT_NEAR(found.constants(0), 0.3, 0.05);
  EXPECT_NEAR(found.constants(1), threshold, 0.05);
  EXPECT_NEAR(found.coefficients(0), 0.8, 0.08);
  EXPECT_EQ(found.values.back().name, "threshold");
  EXPECT_GT(found.values.back().standard_error, 0.0);
}

// Of two thresholds each has the distance to the next value tried that explains clearly less.
TEST(Regimes, AStepBeyondAThresholdHasErrorsOfBoth) {
  constexpr Eigen::Index n = 400;
  llmt::Random random(3);
  Inputs inputs{{"a", "b"}, Eigen::MatrixXd(n, 2)};
  Eigen::MatrixXd measured(n, 1);
  Samples points;
  for (Eigen::Index i = 0; i < n; ++i) {
    inputs.values.row(i) << 2.0 * random.uniform() - 1.0, 2.0 * random.uniform() - 1.0;
    const bool acts = inputs.values(i, 0) > 0.1 && inputs.values(i, 1) > -0.2;
    measured(i, 0) = (acts ? 1.0 : 0.0) + 0.05 * random.normal();
    points.add(std::span(&i, 1));
  }
  const std::vector<ModelTerm> terms = regime_terms(inputs, standard_terms(inputs));
  const auto step = std::ranges::find_if(
      terms, [](const ModelTerm& term) { return term.family == "step" && term.location == "a where b > c"; });
  ASSERT_NE(step, terms.end());
  const Simulation simulation = tabulated(Eigen::MatrixXd::Zero(n, 1), {"y"});
  const Recording recording(inputs);
  const TermModel model(simulation, recording, {"y"}, terms);
  const TermData data{.samples = points, .measured = measured, .sigma = Eigen::VectorXd::Ones(1), .stretches = {}};
  const auto index = static_cast<std::size_t>(step - terms.begin());
  TermFit fit = fit_terms(model, data, Eigen::Vector2d(0.0, 1.0),
                          {{index, 0, Eigen::Vector2d(0.1, -0.2), Eigen::VectorXd::Ones(1), 0.0}});
  set_trial_errors(model, data, fit);
  EXPECT_EQ(fit.placed[0].constants, Eigen::Vector2d(0.1, -0.2));
  EXPECT_NEAR(fit.placed[0].coefficients(0), 1.0, 0.02);
  for (const Eigen::Index constant : {1, 2}) {
    EXPECT_GT(fit.errors[0](constant), 0.0);
    EXPECT_LT(fit.errors[0](constant), 0.25);  // a few steps of those tried
  }
}

TEST(Regimes, AnEffectBeyondAThresholdIsNamedWithIt) {
  const Model model;
  constexpr double threshold = 0.25;
  const auto torque = [&](double t) {
    const Eigen::Vector3d x = motion(t);
    return model.torque(x) + (x(0) > threshold ? 0.5 * x(1) : 0.0);
  };
  const std::uint64_t seeds = sampled(2, 1);
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const Missing missing = missing_from(rows_of_log(seed, model, 0.05, torque));
    EXPECT_EQ(missing.answer, Answer::named) << seed << to_string(missing.answer);
    ASSERT_EQ(missing.found.size(), 1u);
    const FoundTerm& found = missing.found.front();
    EXPECT_EQ(found.family, "linear");
    EXPECT_EQ(found.location, "dq where q > c");
    EXPECT_EQ(found.regime, "q");
    EXPECT_NEAR(found.constants(0), threshold, 0.05);
    EXPECT_NEAR(found.coefficients(0), 0.5, 0.02);
  }
}

// Beside a free mass, whose derivative is cos q, the term C cos q + S sin q says S, and the mass the rest.
TEST(HeldCoefficients, WhatAParameterSaysIsLeftToIt) {
  const Model model;
  constexpr double zero = 0.04;  // of the encoder
  LogRows rows = rows_of_log(1, model, 0.05, [&](double t) {
    const Eigen::Vector3d x = motion(t);
    return model.torque(x) + 9.9 * std::cos(x(0) + zero) - gravity * std::cos(x(0));
  });
  const Simulation simulation =
      linearised(tabulated(rows.simulated, {"u"}), rows.simulated, {{.name = "G", .unit = "N m", .value = gravity}},
                 {Eigen::MatrixXd(rows.inputs.values.col(0).array().cos())});
  const Missing missing = find_missing(simulation, rows.inputs, rows.measured, standard_terms(rows.inputs));
  ASSERT_EQ(missing.found.size(), 1u);
  EXPECT_EQ(missing.answer, Answer::named);
  EXPECT_EQ(missing.found.front().family, "harmonic1");
  EXPECT_EQ(missing.found.front().coefficients(0), 0.0);
  EXPECT_NEAR(missing.found.front().coefficients(1), -9.9 * std::sin(zero), 0.02);
  ASSERT_EQ(missing.fitted_parameters.size(), 1u);
  EXPECT_NEAR(missing.fitted_parameters[0].change, 9.9 * std::cos(zero) - gravity, 0.02);
  EXPECT_TRUE(missing.fitted_parameters[0].changed);
  EXPECT_LT(missing.fitted_parameters[0].standard_error, 0.01);
}

// Noise of inputs is that of the highest frequencies: a motion without noise has next to none.
TEST(HighDifferences, HoldNoMotion) {
  Inputs inputs{{"q", "dq", "ddq"}, Eigen::MatrixXd(400, 3)};
  inputs.instants = Eigen::VectorXd::LinSpaced(400, 0.0, 399 * 0.08);
  for (Eigen::Index i = 0; i < 400; ++i) inputs.values.row(i) = motion(inputs.instants(i)).transpose();
  const Eigen::MatrixXd covariance = noise_in_time(rows_of(inputs, Eigen::VectorXd::Zero(400)), inputs);
  for (Eigen::Index j = 0; j < 3; ++j) {
    const double spread = std::sqrt((inputs.values.col(j).array() - inputs.values.col(j).mean()).square().mean());
    EXPECT_LT(std::sqrt(covariance(j, j)), 2e-4 * spread) << j;
  }
}

}  // namespace
}  // namespace log_test
