// Speeds that are taken from positions, and rows at which a machine rests or reverses.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "discovery/recording/speeds.hpp"
#include "llmt/discovery/simulation.hpp"
#include "llmt/discovery/terms.hpp"
#include "noise.hpp"

namespace motion_test {
namespace {

using namespace llmt::discovery;

constexpr double step = 0.02;  // s
constexpr Eigen::Index rows = 1000;

// Position, speed and acceleration of two sines.
Eigen::MatrixXd moving() {
  Eigen::MatrixXd values = Eigen::MatrixXd::Zero(rows, 3);
  for (const double frequency : {0.31, 0.73}) {
    const double omega = 2.0 * std::numbers::pi * frequency;
    for (Eigen::Index i = 0; i < rows; ++i) {
      const double angle = omega * step * static_cast<double>(i) + frequency;
      values.row(i) +=
          0.4 / omega * Eigen::RowVector3d(std::sin(angle), omega * std::cos(angle), -omega * omega * std::sin(angle));
    }
  }
  return values;
}

Inputs inputs_of(Eigen::MatrixXd values) {
  Inputs inputs{{"q", "dq", "ddq"}, std::move(values)};
  inputs.instants = Eigen::VectorXd::LinSpaced(rows, 0.0, step * static_cast<double>(rows - 1));
  return inputs;
}

void add_noise(Eigen::MatrixXd& values, const Eigen::RowVector3d& deviations, std::uint64_t seed) {
  Noise noise(seed);
  for (Eigen::Index i = 0; i < values.rows(); ++i) {
    for (Eigen::Index j = 0; j < 3; ++j) values(i, j) += deviations(j) * noise.normal();
  }
}

double rms(const Eigen::VectorXd& values) {
  return std::sqrt(values.squaredNorm() / static_cast<double>(values.size()));
}

// 3 ddq + dq.
Eigen::MatrixXd force(const Eigen::MatrixXd& values) { return 3.0 * values.col(2) + values.col(1); }

TEST(Motion, SpeedIsTakenFromThePositionThatIsBetterKnown) {
  const Eigen::MatrixXd truth = moving();
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    Eigen::MatrixXd noisy = truth;
    add_noise(noisy, {1e-4, 0.03, 0.2}, seed);
    const SmoothedInputs smooth = smoothed(Recording(inputs_of(noisy)), force(noisy));
    ASSERT_EQ(smooth.notes.size(), 1u);
    EXPECT_LT(rms(smooth.recording.inputs().values.col(1) - truth.col(1)), 0.03 / 3.0);
    EXPECT_EQ(smooth.recording.inputs().values.col(2), noisy.col(2));
    // The simulation follows: it was computed at the noisy speed.
    const Eigen::VectorXd expected = smooth.recording.inputs().values.col(1) - noisy.col(1);
    EXPECT_LT(rms(smooth.change.col(0) - expected), 1e-6);
  }
}

TEST(Motion, SpeedThatIsWellKnownStays) {
  Eigen::MatrixXd noisy = moving();
  add_noise(noisy, {0.02, 1e-3, 0.2}, 1);
  EXPECT_EQ(smoothed(Recording(inputs_of(noisy)), force(noisy)).change.size(), 0);
  EXPECT_EQ(smoothed(Recording(inputs_of(moving())), force(moving())).change.size(), 0);
  Inputs independent = inputs_of(noisy);
  independent.instants.resize(0);
  EXPECT_EQ(smoothed(Recording(independent), force(noisy)).change.size(), 0);
}

// The acceleration jumps at each reversal, as dry friction makes it: no polynomial goes through.
TEST(Motion, SpeedStaysAsItIsWhereTheAccelerationJumps) {
  constexpr double period = 4.0;
  Eigen::MatrixXd truth(rows, 3);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double phase = std::fmod(step * static_cast<double>(i), period) - 0.5 * period;
    const double side = phase < 0.0 ? -1.0 : 1.0;
    const double from = std::abs(phase);  // of the reversal, the speed falls from 1 to 0 and rises again
    const double forward = std::fmod(step * static_cast<double>(i), 2.0 * period) < period ? 1.0 : -1.0;
    truth.row(i) = forward * Eigen::RowVector3d(0.25 * from * from, side * 0.5 * from, 0.5);
  }
  Eigen::MatrixXd noisy = truth;
  add_noise(noisy, {1e-4, 0.02, 0.02}, 1);
  const SmoothedInputs smooth = smoothed(Recording(inputs_of(noisy)), force(noisy));
  EXPECT_EQ(smooth.recording.inputs().values, noisy);
}

// Moves with rests between them, each at a constant acceleration and its opposite.
Inputs with_rests(std::uint64_t seed) {
  Noise noise(seed);
  Eigen::MatrixXd values = Eigen::MatrixXd::Zero(rows, 3);
  for (Eigen::Index i = 1; i < rows; ++i) {
    const Eigen::Index within = i % 125;
    const double size = 0.6 + 0.1 * static_cast<double>(i / 125);
    const double direction = (i / 125) % 2 == 0 ? size : -size;
    const double acceleration = within < 50 ? direction : within < 100 ? -direction : 0.0;
    values(i, 2) = acceleration;
    values(i, 1) = within < 100 ? values(i - 1, 1) + step * acceleration : 0.0;
    values(i, 0) = values(i - 1, 0) + step * values(i, 1);
  }
  for (Eigen::Index i = 0; i < rows; ++i) values(i, 1) += 1e-3 * noise.normal();
  return inputs_of(values);
}

TEST(Rest, TermsTakeASpeedForZeroWithinItsKnownErrors) {
  Inputs inputs{{"v", "w", "x"}, Eigen::MatrixXd::Zero(4, 3)};
  inputs.zero_bands = Eigen::Vector3d(0.1, 0.1, 0.01);
  inputs.noise = Eigen::Vector3d(0.01, std::numeric_limits<double>::quiet_NaN(), 0.01);
  EXPECT_EQ(bands_of_errors(inputs), inputs.zero_bands);  // rows that no filter made
  inputs.cutoff = 6.0;
  EXPECT_EQ(bands_of_errors(inputs), Eigen::Vector3d(0.04, 0.1, 0.01));
}

TEST(Rest, RowsAtRestAreNoEvidenceOfFriction) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const Inputs inputs = with_rests(seed);
    Noise noise(seed + 100);
    const Eigen::MatrixXd simulated = force(inputs.values);
    MeasuredOutputs measured{{"u"}, simulated};
    for (Eigen::Index i = 0; i < rows; ++i) {
      const double speed = inputs.values(i, 1);
      const bool rests = i % 125 >= 100;
      // At rest the brake holds, whatever the friction would be.
      measured.values(i, 0) += (rests ? 0.0 : (speed > 0.0 ? 1.0 : -1.0) + 2.0 * speed) + 0.05 * noise.normal();
    }
    const Missing missing = find_missing(tabulated(simulated, {"u"}), inputs, measured, standard_terms(inputs));
    EXPECT_EQ(missing.answer, Answer::named) << to_string(missing.answer);
    ASSERT_EQ(missing.found.size(), 2u);
    for (const FoundTerm& found : missing.found) {
      EXPECT_TRUE(found.confirmed);
      const double truth = found.family == "sign" ? 1.0 : 2.0;
      EXPECT_TRUE(found.family == "sign" || found.family == "linear") << found.family;
      EXPECT_NEAR(found.coefficients(0), truth, 0.05 * truth);
    }
    ASSERT_EQ(missing.zero_bands.size(), 3);
    EXPECT_GT(missing.zero_bands(1), 2e-3);
    EXPECT_LT(missing.zero_bands(1), 0.1);
    // What was found adds nothing at rest.
    EXPECT_LT(std::abs(missing.corrected(110, 0) - simulated(110, 0)), 0.05);
  }
}

// Running means of 2 * half + 1 rows.
Eigen::VectorXd low_passed(const Eigen::VectorXd& values, Eigen::Index half) {
  Eigen::VectorXd means(values.size());
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    const Eigen::Index begin = std::max<Eigen::Index>(0, i - half);
    means(i) = values.segment(begin, std::min(values.size(), i + half + 1) - begin).mean();
  }
  return means;
}

// All signals passed a filter, that of the force too: it rounds the jump of the friction, which the simulation has.
TEST(Reversals, FrictionRoundedByAFilterIsNoMissingTerm) {
  const Eigen::MatrixXd values = moving();
  const Inputs inputs = inputs_of(values);
  const auto friction = [](const Eigen::VectorXd& speed) -> Eigen::VectorXd { return 0.5 * speed.cwiseSign(); };
  const Eigen::MatrixXd simulated = force(values) + friction(values.col(1));
  Noise noise(1);
  MeasuredOutputs measured{{"u"}, force(values) + low_passed(friction(values.col(1)), 2)};
  for (double& value : measured.values.reshaped()) value += 0.01 * noise.normal();
  const Missing missing = find_missing(tabulated(simulated, {"u"}), inputs, measured, standard_terms(inputs));
  EXPECT_EQ(missing.answer, Answer::nothing_missing) << to_string(missing.answer);
  const auto speaks_of_reversals = [](const std::string& note) {
    return note.find("at reversals of dq") != std::string::npos && note.find("|dq|") != std::string::npos;
  };
  EXPECT_EQ(std::ranges::count_if(missing.notes, speaks_of_reversals), 1);
  // Drag beside it has its name.
  measured.values.col(0).array() += 1.5 * values.col(1).array() * values.col(1).array().abs();
  const Missing drag = find_missing(tabulated(simulated, {"u"}), inputs, measured, standard_terms(inputs));
  std::string names;
  for (const FoundTerm& found : drag.found) names += found.family + " of " + found.location + ", ";
  ASSERT_EQ(names, "signed_square of dq, ");
  EXPECT_EQ(drag.found.front().family, "signed_square");
  EXPECT_TRUE(drag.found.front().confirmed);
  EXPECT_NEAR(drag.found.front().coefficients(0), 1.5, 0.03);
}

// What is missing near reversals, and has a name, is not set apart; of nested laws the one that suffices is named.
TEST(Reversals, StribecksFrictionHasItsName) {
  const Eigen::MatrixXd values = moving();
  const Inputs inputs = inputs_of(values);
  for (const std::uint64_t seed : {1u, 2u}) {
    Noise noise(seed);
    MeasuredOutputs measured{{"u"}, force(values)};
    measured.values.col(0).array() += values.col(1).array().sign() * (-(values.col(1).array() / 0.15).square()).exp();
    for (double& value : measured.values.reshaped()) value += 0.02 * noise.normal();
    const Missing missing = find_missing(tabulated(force(values), {"u"}), inputs, measured, standard_terms(inputs));
    EXPECT_EQ(missing.answer, Answer::named) << to_string(missing.answer);
    ASSERT_EQ(missing.found.size(), 1u);
    EXPECT_EQ(missing.found.front().family, "stribeck");
    EXPECT_NEAR(missing.found.front().coefficients(0), 1.0, 0.05);
    EXPECT_NEAR(missing.found.front().constants(0), 0.15, 0.01);
    for (const std::string& note : missing.notes) EXPECT_EQ(note.find("reversals"), std::string::npos) << note;
  }
}

TEST(Rest, SignalThatPassesZeroHasNoBand) {
  const Inputs inputs = inputs_of(moving());
  const Eigen::MatrixXd jump = inputs.values.col(1).array().sign().matrix();
  EXPECT_EQ(zero_bands(Recording(inputs), jump).maxCoeff(), 0.0);
  // And rests do not matter where nothing jumps.
  const Inputs resting = with_rests(1);
  EXPECT_EQ(zero_bands(Recording(resting), resting.values.col(1)).maxCoeff(), 0.0);
}

TEST(Rest, SimulationOfTheWrongShapeIsRefused) {
  const Inputs inputs = with_rests(1);
  const MeasuredOutputs measured{{"u"}, force(inputs.values) + inputs.values.col(0)};
  for (const Eigen::Index missing : {1, 500}) {
    Simulation simulation;
    simulation.predict = [&](const Eigen::MatrixXd& values, const Eigen::VectorXd&) -> Eigen::MatrixXd {
      return force(values).topRows(rows - missing);
    };
    try {
      find_missing(simulation, inputs, measured, standard_terms(inputs));
      FAIL();
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find("must be 1000 x 1"), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace motion_test
