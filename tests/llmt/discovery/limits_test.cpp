// Sensors and actuators at their limit.
#include "discovery/terms/limits.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "llmt/discovery/simulation.hpp"
#include "llmt/discovery/terms.hpp"
#include "noise.hpp"

namespace limits_test {
namespace {

using namespace llmt::discovery;

constexpr Eigen::Index n = 2000;

Eigen::VectorXd sine(double amplitude) {
  return amplitude * (0.37 * Eigen::ArrayXd::LinSpaced(n, 0.0, n - 1.0)).sin().matrix();
}

Eigen::VectorXd noise(std::uint64_t seed, double scale) {
  Noise random(seed);
  return Eigen::VectorXd::NullaryExpr(n, [&] { return scale * random.normal(); });
}

std::vector<AtLimit> limits_of(const Eigen::VectorXd& measured, const Eigen::VectorXd& simulated,
                               std::vector<bool>& apart) {
  apart.assign(n, false);
  return rows_at_limits({{"p"}, measured}, simulated, apart);
}

TEST(Limits, OfASensorAreFoundOnBothSides) {
  const Eigen::VectorXd truth = sine(10.0) + noise(1, 0.1);
  std::vector<bool> apart;
  const std::vector<AtLimit> found = limits_of(truth.cwiseMin(8.0).cwiseMax(-9.5), sine(10.0), apart);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].limit, 8.0);
  EXPECT_EQ(found[1].limit, -9.5);
  EXPECT_EQ(found[0].rows, (truth.array() >= 8.0).count());
  EXPECT_EQ(std::ranges::count(apart, true), (truth.array() >= 8.0 || truth.array() <= -9.5).count());
}

TEST(Limits, AreNoEndsOfAResolutionNoRestAndNoLevels) {
  std::vector<bool> apart;
  const Eigen::VectorXd rounded = (sine(10.0) * 4.0).array().round().matrix() / 4.0;
  EXPECT_TRUE(limits_of(rounded, sine(10.3), apart).empty());
  EXPECT_TRUE(limits_of(sine(10.0).cwiseMax(0.0), sine(10.0), apart).empty());  // a valve that is closed
  const Eigen::VectorXd levels = (sine(3.0)).array().round().matrix();
  EXPECT_TRUE(limits_of(levels.cwiseMin(2.0), sine(3.0), apart).empty());
  // The simulation has stopped there as well.
  EXPECT_TRUE(limits_of(sine(10.0).cwiseMin(8.0), sine(10.0).cwiseMin(8.0), apart).empty());
  EXPECT_EQ(std::ranges::count(apart, true), 0);
}

// A complete model and a sensor that stops at 8: nothing is missing at the other rows, and the answer says so.
TEST(Limits, RowsAtALimitAreSetApart) {
  Inputs inputs{{"x", "v"}, Eigen::MatrixXd(n, 2)};
  inputs.values << sine(10.0), noise(2, 1.0);
  const Eigen::VectorXd simulated = inputs.values.col(0) + 0.5 * inputs.values.col(1);
  const MeasuredOutputs measured{{"p"}, (simulated + noise(3, 0.1)).cwiseMin(8.0)};
  const Missing missing = find_missing(tabulated(simulated, {"p"}), inputs, measured, standard_terms(inputs));
  EXPECT_EQ(missing.answer, Answer::nothing_missing);
  EXPECT_TRUE(std::ranges::any_of(missing.notes, [](const std::string& note) {
    return note.find("p is exactly 8, its largest value, at") != std::string::npos;
  }));
}

}  // namespace
}  // namespace limits_test
