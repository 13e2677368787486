// Rows of a log: noise that is alike in neighbours, samples that are means over blocks, rows set aside that decide.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "discovery/answer/judges.hpp"
#include "discovery/recording/noise.hpp"
#include "discovery/recording/row_split.hpp"
#include "discovery/recording/samples.hpp"
#include "llmt/discovery/simulation.hpp"
#include "noise.hpp"
#include "study.hpp"

namespace time_test {
namespace {

using namespace llmt::discovery;

constexpr double step = 0.02;  // s

// First-order autoregressive noise of standard deviation 1.
Eigen::VectorXd correlated(Noise& noise, Eigen::Index n, double rho) {
  Eigen::VectorXd values(n);
  double now = noise.normal();
  for (double& value : values) {
    value = now;
    now = rho * now + std::sqrt(1.0 - rho * rho) * noise.normal();
  }
  return values;
}

// A mass that is driven: position, velocity and acceleration of three sines, and the force of a mass of 3 kg with
// damping. `hidden` is added to what is measured.
struct MassLog {
  Inputs inputs;
  Eigen::MatrixXd simulated;
  MeasuredOutputs measured;
};

using Force = double (*)(double q, double dq, double ddq);

MassLog log_of(std::uint64_t seed, Eigen::Index n, double noise, double rho, Force hidden) {
  Noise random(seed);
  MassLog log;
  log.inputs.names = {"q", "dq", "ddq"};
  log.inputs.values = Eigen::MatrixXd::Zero(n, 3);
  log.inputs.instants = Eigen::VectorXd::LinSpaced(n, 0.0, step * static_cast<double>(n - 1));
  for (int k = 0; k < 4; ++k) {
    const double omega = 2.0 * std::numbers::pi * (0.1 + 0.7 * random.uniform());
    const double phase = 6.3 * random.uniform();
    const double amplitude = 0.3 / omega;
    for (Eigen::Index i = 0; i < n; ++i) {
      const double angle = omega * log.inputs.instants(i) + phase;
      log.inputs.values.row(i) +=
          amplitude * Eigen::RowVector3d(std::sin(angle), omega * std::cos(angle), -omega * omega * std::sin(angle));
    }
  }
  log.simulated = 3.0 * log.inputs.values.col(2) + log.inputs.values.col(1);
  log.measured = {{"force"}, log.simulated + noise * correlated(random, n, rho)};
  for (Eigen::Index i = 0; i < n; ++i) {
    log.measured.values(i, 0) += hidden(log.inputs.values(i, 0), log.inputs.values(i, 1), log.inputs.values(i, 2));
  }
  return log;
}

double nothing(double, double, double) { return 0.0; }
double drag(double, double dq, double) { return 1.5 * dq * std::abs(dq); }

Missing missing_from(const MassLog& log, const MissingOptions& options = {}) {
  return find_missing(tabulated(log.simulated, {"force"}), log.inputs, log.measured, standard_terms(log.inputs),
                      options);
}

Samples blocks(Eigen::Index n, Eigen::Index length) {
  Samples samples;
  std::vector<Eigen::Index> rows(length);
  for (Eigen::Index begin = 0; begin + length <= n; begin += length) {
    for (Eigen::Index k = 0; k < length; ++k) rows[k] = begin + k;
    samples.add(rows);
  }
  return samples;
}

TEST(InTime, MeansOfASineKeepTheShareOfTheClosedForm) {
  constexpr Eigen::Index n = 12000;
  constexpr Eigen::Index length = 12;
  for (const double period : {18.0, 40.0, 100.0}) {
    Eigen::VectorXd sine(n);
    for (Eigen::Index i = 0; i < n; ++i) sine(i) = std::sin(2.0 * std::numbers::pi * static_cast<double>(i) / period);
    // Dirichlet kernel: the amplitude of a mean over L rows is sin(pi L / P) / (L sin(pi / P)).
    const double amplitude =
        std::sin(std::numbers::pi * length / period) / (length * std::sin(std::numbers::pi / period));
    EXPECT_NEAR(share_kept(sine, means(sine, blocks(n, length)), blocks(n, length)), amplitude * amplitude, 0.01)
        << period;
  }
}

TEST(InTime, CarriersCountTheSamplesOfAPulse) {
  Eigen::VectorXd pulse = Eigen::VectorXd::Zero(1000);
  pulse.head(4).setOnes();
  EXPECT_NEAR(carriers(pulse), 4.0, 0.1);
  Noise noise(1);
  for (double& value : pulse) value = noise.normal();
  EXPECT_NEAR(carriers(pulse), 1000.0 / 3.0, 60.0);  // the fourth moment of normal values is 3
}

TEST(InTime, NoiseOfASmoothSignalIsFoundByThirdDifferences) {
  Noise noise(3);
  Eigen::VectorXd values(5000);
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    values(i) = 10.0 * std::sin(0.05 * static_cast<double>(i)) + 0.2 * noise.normal();
  }
  EXPECT_NEAR(std::sqrt(noise_variance(values)), 0.2, 0.01);
  EXPECT_TRUE(std::isnan(noise_variance(values.head(3))));
}

TEST(InTime, IndependentShareIsThatOfTheAutoregressiveProcess) {
  for (const double rho : {0.3, 0.7, 0.9}) {
    Noise noise(5);
    constexpr Eigen::Index n = 60000;
    const std::vector<Eigen::Index> one(n, 0);
    const double share = independent_share(autocorrelation(correlated(noise, n, rho), one, std::vector<bool>(n, true)));
    EXPECT_NEAR(share, (1.0 - rho) / (1.0 + rho), 0.1 * (1.0 - rho)) << rho;
  }
}

TEST(InTime, InflationIsTheVarianceOfASlopeUnderCorrelatedNoise) {
  constexpr Eigen::Index n = 400;
  constexpr double rho = 0.8;
  Eigen::VectorXd influence(n);
  for (Eigen::Index i = 0; i < n; ++i) influence(i) = std::sin(0.1 * static_cast<double>(i));
  influence /= influence.squaredNorm();
  Noise noise(7);
  double squares = 0.0;
  constexpr int draws = 2000;
  for (int k = 0; k < draws; ++k) squares += std::pow(influence.dot(correlated(noise, n, rho)), 2.0);
  std::vector<double> correlation;
  for (int lag = 1; lag < 40; ++lag) correlation.push_back(std::pow(rho, lag));
  const double expected = squares / draws / influence.squaredNorm();
  EXPECT_NEAR(variance_inflation(correlation, influence, std::vector<Eigen::Index>(n, 0)), expected, 0.1 * expected);
}

// 0.003 is the rate of false alarms asked for: 20 draws have none with a probability of 94 %, at a rate of 0.05 of 36
// %.
TEST(InTime, CorrelatedNoiseIsNoMissingTerm) {
  const std::uint64_t seeds = sampled(20, 5);
  int alarms = 0;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const Missing missing = missing_from(log_of(seed, 500, 0.2, std::exp(-step / 0.2), nothing));
    EXPECT_TRUE(missing.time.in_time);
    EXPECT_LT(missing.time.independent_share, 0.8) << seed;
    alarms += missing.answer != Answer::nothing_missing ? 1 : 0;
  }
  EXPECT_EQ(alarms, 0);
}

// What drifts along the whole log says little of terms, and is not "nothing" either.
TEST(InTime, ADriftIsNotNothing) {
  const std::uint64_t seeds = sampled(3, 1);
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    MassLog log = log_of(seed, 1000, 0.05, 0.0, nothing);
    EXPECT_FALSE(is_drift(missing_from(log)));
    log.measured.values.array() -= 0.5 * (1.0 - (-log.inputs.instants.array() / 10.0).exp());  // 10 of 20 s
    const Missing missing = missing_from(log);
    EXPECT_EQ(missing.answer, Answer::unknown);
    EXPECT_TRUE(is_drift(missing));
    EXPECT_FALSE(missing.notes.empty());
  }
}

TEST(InTime, StandardErrorsHoldUnderCorrelatedNoise) {
  const int seeds = sampled(20, 6);
  int named = 0;
  int covered = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    const Missing missing =
        missing_from(log_of(static_cast<std::uint64_t>(seed), 500, 0.1, std::exp(-step / 0.2), drag));
    for (const FoundTerm& found : missing.found) {
      if (found.family != "signed_square" || found.location != "dq" || missing.found.size() != 1) continue;
      ++named;
      const TermValue& value = found.values.front();
      covered += std::abs(value.value - 1.5) < 1.96 * value.standard_error ? 1 : 0;
    }
  }
  EXPECT_GE(10 * named, 9 * seeds);
  // 95 % of 18 to 20, less three standard deviations of the count.
  EXPECT_GE(covered, named * 80 / 100);
}

TEST(InTime, RowsOfSmoothNoisyInputsAreTakenForALog) {
  MassLog log = log_of(1, 1000, 0.05, 0.0, drag);
  log.inputs.instants = {};
  Noise noise(2);
  for (double& value : log.inputs.values.col(2)) value += 0.02 * noise.normal();
  const Missing missing = missing_from(log);
  EXPECT_TRUE(missing.time.in_time);
  EXPECT_TRUE(missing.time.found_out);
  ASSERT_EQ(missing.found.size(), 1U);
  EXPECT_EQ(missing.found.front().family, "signed_square");
}

TEST(InTime, ShuffledRowsAreIndependent) {
  MassLog log = log_of(1, 600, 0.05, 0.0, drag);
  log.inputs.instants = {};
  // 257 and 600 have no common divisor.
  std::vector<Eigen::Index> order(600);
  for (Eigen::Index i = 0; i < 600; ++i) order[i] = (257 * i) % 600;
  log.inputs.values = log.inputs.values(order, Eigen::all).eval();
  log.simulated = log.simulated(order, Eigen::all).eval();
  log.measured.values = log.measured.values(order, Eigen::all).eval();
  EXPECT_FALSE(missing_from(log).time.in_time);
}

TEST(InTime, WholeRunsAreSetAside) {
  MassLog log = log_of(1, 1000, 0.05, 0.0, drag);
  for (Eigen::Index i = 0; i < 1000; ++i) log.inputs.runs.push_back(7 - i / 200);
  const Missing missing = missing_from(log);
  std::set<Eigen::Index> aside;
  for (const Eigen::Index row : missing.held_out) aside.insert(log.inputs.runs[row]);
  EXPECT_EQ(aside.size(), 1U);
  EXPECT_EQ(missing.held_out.size(), 200U);
  EXPECT_EQ(missing.searched.size(), 800U);
}

// Drag that is there in four runs of five, whichever run is set aside, is not named: it fails in the fifth, or its size
// contradicts.
TEST(InTime, RowsSetAsideRefuteATermThatDoesNotHoldThere) {
  MassLog log = log_of(1, 1000, 0.02, 0.0, drag);
  for (Eigen::Index i = 0; i < 1000; ++i) log.inputs.runs.push_back(i / 200);
  MissingOptions options;
  const Missing first = missing_from(log, options);
  ASSERT_EQ(first.answer, Answer::named);
  for (const Eigen::Index row : first.held_out) {
    log.measured.values(row, 0) = log.simulated(row, 0) - drag(0.0, log.inputs.values(row, 1), 0.0);
  }
  const Missing missing = missing_from(log, options);
  ASSERT_FALSE(missing.notes.empty());
  EXPECT_NE(missing.notes.front().find("signed_square dq was found and taken back"), std::string::npos);
}

TEST(InTime, WrongTimesAreRefused) {
  const auto message = [](const MassLog& log) {
    try {
      missing_from(log);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  MassLog log = log_of(1, 200, 0.1, 0.0, nothing);
  log.inputs.instants(7) = log.inputs.instants(6);
  EXPECT_NE(message(log).find("rows 7 and 8 were taken at the same time"), std::string::npos) << message(log);
  log.inputs.instants(7) = std::nan("");
  EXPECT_NE(message(log).find("not finite"), std::string::npos);
  log.inputs.instants = Eigen::VectorXd::Zero(3);
  EXPECT_NE(message(log).find("3 instants for 200 rows"), std::string::npos);
  log = log_of(1, 200, 0.1, 0.0, nothing);
  log.inputs.runs = {1, 2};
  EXPECT_NE(message(log).find("2 labels of runs for 200 rows"), std::string::npos);
}

TEST(InTime, FamiliesAreChosenByName) {
  const MassLog log = log_of(1, 200, 0.1, 0.0, nothing);
  for (const ModelTerm& term : of_families(standard_terms(log.inputs), {"linear", "square"}, {"square"})) {
    EXPECT_TRUE(term.generic || term.family == "linear") << term.family;
  }
  EXPECT_THROW(of_families(standard_terms(log.inputs), {}, {"lineal"}), std::invalid_argument);
}

// The acceleration of a mass is known from its position, its velocity and the time of a sine, but for its error:
// samples that are alike in all inputs have like errors, and so have their forces.
TEST(InTime, ErrorsOfAnInputAreNoStructure) {
  int complete = 0;
  const int logs = sampled(12, 3);
  for (int seed = 1; seed <= logs; ++seed) {
    MassLog log = log_of(static_cast<std::uint64_t>(seed), 1200, 0.01, 0.0, nothing);
    Noise noise(static_cast<std::uint64_t>(100 + seed));
    for (Eigen::Index i = 0; i < log.inputs.values.rows(); ++i) log.inputs.values(i, 2) += 0.1 * noise.normal();
    log.simulated = 3.0 * log.inputs.values.col(2) + log.inputs.values.col(1);
    complete += missing_from(log).answer == Answer::nothing_missing;
  }
  EXPECT_EQ(complete, logs);
}

}  // namespace
}  // namespace time_test
