#include "llmt/discovery/terms.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "llmt/discovery/simulation.hpp"
#include "llmt/random.hpp"

namespace {

using namespace llmt::discovery;

/// A table of inputs t = 0, 0.5, ..., a in -2 ... 5, b in 0 ... 1, and a simulation 3 + 2 a - 4 b.
struct Bench {
  Inputs inputs;
  Eigen::MatrixXd simulated;
  MeasuredOutputs measured;

  Eigen::VectorXd column(int j) const { return inputs.values.col(j); }
};

using Hidden = std::function<double(double t, double a, double b, double y)>;

Bench bench(std::uint64_t seed, Eigen::Index rows, double noise, const Hidden& hidden) {
  llmt::Random random(seed);
  Bench bench;
  bench.inputs.names = {"t", "a", "b"};
  bench.inputs.values.resize(rows, 3);
  bench.simulated.resize(rows, 1);
  bench.measured = {{"y"}, Eigen::MatrixXd(rows, 1)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double t = 0.5 * static_cast<double>(i);
    const double a = random.uniform(-2.0, 5.0);
    const double b = random.uniform(0.0, 1.0);
    bench.inputs.values.row(i) << t, a, b;
    const double y = 3.0 + 2.0 * a - 4.0 * b;
    bench.simulated(i, 0) = y;
    bench.measured.values(i, 0) = y + hidden(t, a, b, y) + noise * random.normal();
  }
  return bench;
}

Missing missing_from(const Bench& bench, const MissingOptions& options = {}) {
  return find_missing(tabulated(bench.simulated, {"y"}), bench.inputs, bench.measured, standard_terms(bench.inputs),
                      options);
}

struct Expected {
  const char* family;
  const char* location;
  Hidden hidden;
  std::vector<double> values;  // coefficients, then constants; NaN: not compared
};

std::vector<Expected> hidden_terms() {
  constexpr double pi = std::numbers::pi;
  const double any = std::nan("");
  return {
      {"offset", "", [](double, double, double, double) { return 0.3; }, {0.3}},
      {"gain", "", [](double, double, double, double y) { return 0.03 * y; }, {0.03}},
      {"gain_curvature", "", [](double, double, double, double y) { return 0.01 * y * y; }, {0.01}},
      {"linear", "b", [](double, double, double b, double) { return -0.4 * b; }, {-0.4}},
      {"square", "a", [](double, double a, double, double) { return 0.1 * a * a; }, {0.1}},
      {"cube", "a", [](double, double a, double, double) { return 0.02 * a * a * a; }, {0.02}},
      {"product", "a,b", [](double, double a, double b, double) { return 0.2 * a * b; }, {0.2}},
      {"absolute", "a", [](double, double a, double, double) { return 0.2 * std::abs(a); }, {0.2}},
      {"sign", "a", [](double, double a, double, double) { return a > 0.0 ? 0.2 : -0.2; }, {0.2}},
      {"wave",
       "a",
       [](double, double a, double, double) { return 0.2 * std::sin(2.0 * pi * a / 0.83); },
       {0.0, 0.2, 0.83}},
      {"step", "a", [](double, double a, double, double) { return a > 3.2 ? 0.3 : 0.0; }, {0.3, 3.2}},
      {"hinge", "a", [](double, double a, double, double) { return 0.2 * std::max(0.0, a - 2.0); }, {0.2, 2.0}},
      {"settling", "t", [](double t, double, double, double) { return 0.5 * std::exp(-t / 12.0); }, {0.5, 12.0}},
      {"settling", "a", [](double, double a, double, double) { return 0.5 * std::exp(-(a + 2.0) / 0.9); }, {any, 0.9}},
  };
}

TEST(StandardTerms, HiddenOnesAreNamedWithTheirConstants) {
  constexpr int seeds = 12;
  for (const Expected& expected : hidden_terms()) {
    int right = 0;
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      const Missing missing = missing_from(bench(seed, 200, 0.05, expected.hidden));
      const std::string name = std::string(expected.family) + " " + expected.location;
      if (missing.found.size() != 1 || missing.found[0].family != expected.family ||
          missing.found[0].location != expected.location) {
        continue;
      }
      ++right;
      const FoundTerm& found = missing.found[0];
      EXPECT_TRUE(found.confirmed) << name;
      ASSERT_EQ(found.values.size(), expected.values.size());
      for (std::size_t k = 0; k < found.values.size(); ++k) {
        if (std::isnan(expected.values[k])) continue;
        EXPECT_NEAR(found.values[k].value, expected.values[k], 5.0 * found.values[k].standard_error)
            << name << " " << found.values[k].name << " seed " << seed;
        EXPECT_LT(found.values[k].standard_error, 0.2 * (0.1 + std::abs(expected.values[k]))) << name;
      }
      EXPECT_LT(missing.gaps[0].after, 0.08) << name;
      EXPECT_GT(missing.gaps[0].before, missing.gaps[0].after) << name;
      EXPECT_NEAR(missing.gaps[0].noise_floor, 0.05, 0.015) << name;
    }
    EXPECT_GE(right, seeds - 2) << expected.family << " " << expected.location;
  }
}

TEST(StandardTerms, NoiseHasNone) {
  for (const Eigen::Index rows : {30, 200}) {
    constexpr int seeds = 200;
    int alarms = 0;
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      const Missing missing =
          missing_from(bench(seed * 31, rows, 0.05, [](double, double, double, double) { return 0.0; }));
      alarms += missing.verdict.answer != Answer::nothing_missing ? 1 : 0;
    }
    EXPECT_LE(alarms, seeds * 2 / 100) << rows << " rows";
  }
}

}  // namespace
