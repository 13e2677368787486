// Sensors and actuators at their limit.
#include "discovery/recording/apart.hpp"

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

std::vector<Apart> limits_of(const Eigen::VectorXd& measured, const Eigen::VectorXd& simulated) {
  const Recording recording({{"x"}, simulated});
  return rows_apart(ApartWhen::before_searches, {recording, {{"p"}, measured}, simulated});
}

TEST(Limits, OfASensorAreFoundOnBothSides) {
  const Eigen::VectorXd truth = sine(10.0) + noise(1, 0.1);
  const std::vector<Apart> found = limits_of(truth.cwiseMin(8.0).cwiseMax(-9.5), sine(10.0));
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].reason, ApartReason::at_limit);
  EXPECT_TRUE(found[0].sentence.starts_with("p is exactly 8, its largest value,")) << found[0].sentence;
  EXPECT_TRUE(found[1].sentence.starts_with("p is exactly -9.5, its smallest value,")) << found[1].sentence;
  EXPECT_EQ(std::ssize(found[0].rows), (truth.array() >= 8.0).count());
  std::vector<bool> apart(n, false);
  mark(found, apart);
  EXPECT_EQ(std::ranges::count(apart, true), (truth.array() >= 8.0 || truth.array() <= -9.5).count());
}

TEST(Limits, AreNoEndsOfAResolutionNoRestAndNoLevels) {
  const Eigen::VectorXd rounded = (sine(10.0) * 4.0).array().round().matrix() / 4.0;
  EXPECT_TRUE(limits_of(rounded, sine(10.3)).empty());
  EXPECT_TRUE(limits_of(sine(10.0).cwiseMax(0.0), sine(10.0)).empty());  // a valve that is closed
  const Eigen::VectorXd levels = (sine(3.0)).array().round().matrix();
  EXPECT_TRUE(limits_of(levels.cwiseMin(2.0), sine(3.0)).empty());
  // The simulation has stopped there as well.
  EXPECT_TRUE(limits_of(sine(10.0).cwiseMin(8.0), sine(10.0).cwiseMin(8.0)).empty());
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
