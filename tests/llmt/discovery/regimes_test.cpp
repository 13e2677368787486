// Effects that act beyond a threshold alone.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "discovery/answer/contests.hpp"
#include "discovery/answer/contests_of_regimes.hpp"
#include "discovery/answer/question.hpp"
#include "discovery/answer/term_fit.hpp"
#include "discovery/recording/row_split.hpp"
#include "llmt/discovery/missing.hpp"
#include "llmt/discovery/simulation.hpp"
#include "llmt/discovery/terms.hpp"
#include "noise.hpp"

namespace regimes_test {
namespace {

using namespace llmt::discovery;

constexpr Eigen::Index rows = 800;
constexpr double threshold = 0.4321;

// A level h, a temperature T and a speed v; y = what acts at h > threshold.
Missing missing_from(double (*effect)(double temperature, double speed)) {
  Inputs inputs{{"h", "T", "v"}, Eigen::MatrixXd(rows, 3)};
  inputs.instants = Eigen::VectorXd::LinSpaced(rows, 0.0, 0.04 * (rows - 1));
  inputs.noise = Eigen::VectorXd::Zero(3);
  MeasuredOutputs measured{{"y"}, Eigen::MatrixXd(rows, 1)};
  measured.noise = Eigen::VectorXd::Constant(1, 0.02);
  Noise random(7);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double t = inputs.instants(i);
    const double h = std::sin(0.83 * t) + 0.3 * std::sin(2.9 * t + 1.0);
    const double temperature = 25.0 + 8.0 * std::sin(1.37 * t) + 3.0 * std::sin(3.3 * t);
    const double speed = std::sin(2.1 * t) + 0.6 * std::sin(5.3 * t + 0.4);
    inputs.values.row(i) << h, temperature, speed;
    measured.values(i, 0) = (h > threshold ? effect(temperature, speed) : 0.0) + 0.02 * random.normal();
  }
  std::vector<ModelTerm> terms = standard_terms(inputs);
  for (ModelTerm& term : regime_terms(inputs, terms)) terms.push_back(std::move(term));
  return find_missing(tabulated(Eigen::MatrixXd::Zero(rows, 1), {"y"}), inputs, measured, terms, {});
}

// What acts there hardly changes its size, as a step would.
TEST(Regimes, ALawThatIsNearlyAStepIsNamed) {
  const Missing missing =
      missing_from([](double temperature, double) { return 9.0 * temperature / (9.0 + temperature); });
  ASSERT_EQ(missing.found.size(), 1U);
  const FoundTerm& found = missing.found[0];
  EXPECT_EQ(found.family, "saturation");
  EXPECT_EQ(found.location, "T where h > c");
  EXPECT_NEAR(found.coefficients(0), 9.0, 0.5);
  EXPECT_NEAR(found.constants(1), threshold, 0.02);
}

// Its constant and its threshold, which stands between those that are tried, are fitted in turn.
TEST(Regimes, AConstantAndAThresholdAreFittedTogether) {
  const Missing missing = missing_from([](double, double speed) { return 2.0 * std::tanh(speed / 0.3); });
  ASSERT_EQ(missing.found.size(), 1U);
  const FoundTerm& found = missing.found[0];
  EXPECT_EQ(found.family, "tanh");
  EXPECT_EQ(found.location, "v where h > c");
  EXPECT_TRUE(found.confirmed);
  EXPECT_NEAR(found.coefficients(0), 2.0, 0.02);
  EXPECT_NEAR(found.constants(0), 0.3, 0.01);
  EXPECT_NEAR(found.constants(1), threshold, 0.01);
}

// Two constants and the threshold.
TEST(Regimes, ASigmoidIsNamedWithItsConstants) {
  const Missing missing =
      missing_from([](double, double speed) { return 3.0 / (1.0 + std::exp(-(speed - 0.2) / 0.15)); });
  ASSERT_EQ(missing.found.size(), 1U);
  const FoundTerm& found = missing.found[0];
  EXPECT_EQ(found.family, "sigmoid");
  EXPECT_EQ(found.location, "v where h > c");
  EXPECT_TRUE(found.confirmed);
  EXPECT_NEAR(found.coefficients(0), 3.0, 0.05);
  EXPECT_NEAR(found.constants(0), 0.2, 0.01);
  EXPECT_NEAR(found.constants(1), 0.15, 0.01);
  EXPECT_NEAR(found.constants(2), threshold, 0.03);  // the means of four rows nearest to it are so far apart
  EXPECT_EQ(found.code[0], "(1/(1+exp(-($1-$c)/$d)))*($2 > $e)");
}

// No term without constants comes near: the size of the deviations tells the threshold.
TEST(Regimes, AWaveIsFoundWhereDeviationsAreLarge) {
  const Missing missing =
      missing_from([](double, double speed) { return 0.2 * std::sin(2.0 * std::numbers::pi * speed / 0.3); });
  ASSERT_EQ(missing.found.size(), 1U);
  const FoundTerm& found = missing.found[0];
  EXPECT_EQ(found.family, "wave");
  EXPECT_EQ(found.location, "v where h > c");
  EXPECT_NEAR(found.coefficients(1), 0.2, 0.01);
  EXPECT_NEAR(found.constants(0), 0.3, 0.003);
  EXPECT_NEAR(found.constants(1), threshold, 0.03);
}

// Without the law, then without any that has a constant of its own there; the threshold stays.
TEST(Regimes, ALawIsHeldAgainstSimplerOnesAtItsThreshold) {
  Inputs inputs{{"h", "v"}, Eigen::MatrixXd(100, 2)};
  inputs.values.col(0) = Eigen::VectorXd::LinSpaced(100, 0.0, 1.0);
  inputs.values.col(1) = (7.0 * inputs.values.col(0).array()).sin();
  const std::vector<ModelTerm> terms = regime_terms(inputs, standard_terms(inputs));
  const auto place = [&](const std::string& family, const std::string& location) {
    return static_cast<std::size_t>(
        std::ranges::find_if(
            terms, [&](const ModelTerm& term) { return term.family == family && term.location == location; }) -
        terms.begin());
  };
  const std::string here = "v where h > c";
  Missing found;
  found.found.resize(1);
  found.found[0].term = place("coulomb_stribeck", here);
  found.found[0].family = "coulomb_stribeck";
  found.found[0].location = here;
  found.found[0].regime = "h";
  found.found[0].inputs = terms.at(found.found[0].term).inputs;
  found.found[0].constants = Eigen::Vector2d(0.1, 0.5);
  const std::vector<Others> others = simpler_in_these_regimes(found, terms, {}, {});
  ASSERT_EQ(others.size(), 2U);
  const auto is_tried = [&](std::size_t search, const std::string& family, const std::string& location) {
    return !others[search].left_out.contains(place(family, location));
  };
  EXPECT_FALSE(is_tried(0, "coulomb_stribeck", here));
  EXPECT_TRUE(is_tried(0, "stribeck", here));
  EXPECT_FALSE(is_tried(1, "stribeck", here));
  for (const std::size_t search : {0U, 1U}) {
    EXPECT_TRUE(is_tried(search, "sign", here));
    EXPECT_FALSE(is_tried(search, "sign", "v where h <= c"));
    EXPECT_LE(others[search].terms[place("sign", here)].constants.back().tried.size(), 3U);
  }
  found.found[0].constants = Eigen::VectorXd::Constant(1, 0.5);  // none of its own
  EXPECT_TRUE(simpler_in_these_regimes(found, terms, {}, {}).empty());
}

// The gates of deviations that are normal, of the standard deviation 1 where h > 0.4321, and of `elsewhere`.
std::map<std::string, double> gates_of(double elsewhere) {
  Inputs inputs{{"h", "w"}, Eigen::MatrixXd(rows, 2)};
  inputs.instants = Eigen::VectorXd::LinSpaced(rows, 0.0, 0.04 * (rows - 1));
  MeasuredOutputs measured{{"y"}, Eigen::MatrixXd(rows, 1)};
  Noise random(2);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double t = inputs.instants(i);
    inputs.values.row(i) << std::sin(0.83 * t), std::sin(1.7 * t);
    measured.values(i, 0) = (inputs.values(i, 0) > threshold ? 1.0 : elsewhere) * random.normal();
  }
  const Simulation simulation = tabulated(Eigen::MatrixXd::Zero(rows, 1), {"y"});
  const Recording recording(inputs);
  Missing found;
  found.before = Eigen::MatrixXd::Zero(rows, 1);
  found.gaps = {{.output = "y", .noise_floor = 0.1}};
  return gates_of_size(CrossValidation(simulation, recording, measured, {}, {.fewest_samples = rows}, {}), found);
}

TEST(Regimes, GatesAreWhereDeviationsChangeTheirSize) {
  const std::map<std::string, double> gates = gates_of(0.1);
  ASSERT_TRUE(gates.contains("h"));
  EXPECT_NEAR(gates.at("h"), threshold, 0.02);
  EXPECT_TRUE(gates_of(1.0).empty());
}

// Rows of x, and of v, which is within 0.1 at every second row; y = |x| where v > 0.04. Friction holds at some rows.
struct Resting {
  static constexpr Eigen::Index n = 400;
  Inputs inputs{{"x", "v"}, Eigen::MatrixXd(n, 2)};
  MeasuredOutputs measured{{"y"}, Eigen::MatrixXd(n, 1)};

  explicit Resting(Eigen::Index held) {
    Noise random(3);
    inputs.instants = Eigen::VectorXd::LinSpaced(n, 0.0, 1.0);
    for (Eigen::Index i = 0; i < n; ++i) {
      const double x = std::sin(0.37 * static_cast<double>(i));
      const double v = (i % 2 == 0 ? 0.1 : 1.0) * std::sin(0.11 * static_cast<double>(i));
      inputs.values.row(i) << x, v;
      measured.values(i, 0) = (v > 0.04 ? std::abs(x) : 0.0) + 0.01 * random.normal();
      if (i % 2 == 0 && i < held) measured.values(i, 0) += 2.0;
    }
  }

  // Placed from `start`; rows within 0.1 are at rest.
  double placed_from(double start) const {
    std::vector<ModelTerm> terms = standard_terms(inputs);
    for (ModelTerm& term : regime_terms(inputs, terms)) terms.push_back(std::move(term));
    const auto wanted = std::ranges::find_if(
        terms, [](const ModelTerm& term) { return term.family == "absolute" && term.location == "x where v > c"; });
    const Simulation simulation = tabulated(Eigen::MatrixXd::Zero(n, 1), {"y"});
    const Recording recording(inputs);
    const TermModel model(simulation, recording, {"y"}, terms);
    Missing missing;
    missing.gaps.push_back({.output = "y", .noise_floor = 0.01});
    TermFit fit;
    fit.parameters = values_of(simulation.parameters);
    fit.placed.push_back({.term = static_cast<std::size_t>(wanted - terms.begin()),
                          .output = 0,
                          .constants = Eigen::VectorXd::Constant(1, start),
                          .coefficients = Eigen::VectorXd::Ones(1)});
    SearchedRows searched;
    searched.bands_of_rest = Eigen::Vector2d(0.0, 0.1);
    place_thresholds_at_rest(model, measured, searched, missing, n / 4.0, fit);
    return fit.placed[0].constants(0);
  }
};

TEST(Regimes, AThresholdWithinTheBandOfRestIsThatOfRowsAtRest) {
  EXPECT_NEAR(Resting(0).placed_from(0.0), 0.04, 0.005);
  // Friction that holds at a third of them says nothing of it.
  EXPECT_NEAR(Resting(130).placed_from(0.0), 0.04, 0.005);
  // Where it holds everywhere no row tells: what was fitted stays.
  EXPECT_EQ(Resting(400).placed_from(0.0), 0.0);
  EXPECT_EQ(Resting(0).placed_from(0.2), 0.2);
}

}  // namespace
}  // namespace regimes_test
