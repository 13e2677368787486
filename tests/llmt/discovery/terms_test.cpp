#include "llmt/discovery/terms.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "llmt/discovery/simulation.hpp"
#include "llmt/random.hpp"
#include "study.hpp"

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
      {"square_product", "b,a", [](double, double a, double b, double) { return 0.2 * b * b * a; }, {0.2}},
      {"square_product", "a,b", [](double, double a, double b, double) { return 0.05 * a * a * b; }, {0.05}},
      {"signed_square", "a", [](double, double a, double, double) { return 0.05 * a * std::abs(a); }, {0.05}},
      {"root", "t", [](double t, double, double, double) { return 0.1 * std::sqrt(t); }, {0.1}},
      {"saturation", "t", [](double t, double, double, double) { return t / (8.0 + t); }, {1.0, 8.0}},
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
  const int seeds = sampled(2, 1);
  for (const Expected& expected : hidden_terms()) {
    int right = 0;
    for (std::uint64_t seed = 1; seed <= static_cast<std::uint64_t>(seeds); ++seed) {
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
    EXPECT_EQ(right, seeds) << expected.family << " " << expected.location;
  }
}

TEST(StandardTerms, NoiseHasNone) {
  for (const Eigen::Index rows : {30, 200}) {
    const int seeds = sampled(30, 8);
    int alarms = 0;
    for (std::uint64_t seed = 1; seed <= static_cast<std::uint64_t>(seeds); ++seed) {
      const Missing missing =
          missing_from(bench(seed * 31, rows, 0.05, [](double, double, double, double) { return 0.0; }));
      alarms += missing.verdict.answer != Answer::nothing_missing ? 1 : 0;
    }
    EXPECT_EQ(alarms, 0) << rows << " rows";
  }
}

TEST(StandardTerms, WhatTheyDoNotHoldIsNotConfirmed) {
  const std::vector<Hidden> hidden = {
      [](double, double a, double, double) { return 0.5 * std::exp(-std::pow((a - 1.0) / 0.7, 2)); },
      [](double, double a, double, double) { return (a - 1.3) * std::exp(-std::pow(a - 1.3, 2)); },
      [](double, double a, double b, double) {
        return 0.4 * std::exp(-std::pow(a - 1.0, 2)) * std::tanh(6.0 * b - 3.0);
      },
      [](double, double a, double b, double) { return 0.3 * std::sin(3.0 * a * b); },
      [](double t, double, double, double) { return 0.3 * std::sin(2.0 * std::numbers::pi * t / (8.0 + 0.05 * t)); },
      [](double, double a, double b, double) { return 2.0 * a * b / (0.3 + b); },
      [](double, double a, double b, double) { return 20.0 * a * a / (4.0 + a) * (b + 0.1); },
  };
  for (std::size_t k = 0; k < hidden.size(); ++k) {
    int unsure = 0;
    const int seeds = sampled(3, 1);
    for (std::uint64_t seed = 1; seed <= static_cast<std::uint64_t>(seeds); ++seed) {
      const Missing missing = missing_from(bench(seed, 200, 0.05, hidden[k]));
      unsure += std::ranges::none_of(missing.found, &FoundTerm::confirmed) ? 1 : 0;
      // "Named" would say that the names are sure.
      EXPECT_EQ(missing.answer, Answer::unknown) << k;
    }
    EXPECT_EQ(unsure, seeds) << k;
  }
}

TEST(StandardTerms, AUnknownEffectTellsWhatItDependsOn) {
  const Missing missing = missing_from(bench(3, 200, 0.05, [](double, double a, double b, double) {
    return 0.5 * std::exp(-std::pow(a - 1.0, 2) / 0.5) * b;
  }));
  EXPECT_EQ(missing.answer, Answer::unknown);
  ASSERT_FALSE(missing.found.empty());
  EXPECT_EQ(missing.found[0].inputs, (std::vector<std::string>{"a", "b"}));
  EXPECT_TRUE(missing.found[0].generic);
  EXPECT_LT(missing.gaps[0].after, 0.75 * missing.gaps[0].before);
}

TEST(StandardTerms, SeveralAreFoundTogether) {
  const Missing missing = missing_from(bench(4, 300, 0.05, [](double t, double a, double b, double) {
    return 0.5 * std::exp(-t / 12.0) + (a > 3.2 ? 0.3 : 0.0) - (a > 1.0 ? 0.4 : 0.0) + 0.2 * a * b;
  }));
  std::vector<std::string> names;
  for (const FoundTerm& found : missing.found) names.push_back(found.family + " " + found.location);
  std::ranges::sort(names);
  EXPECT_EQ(names, (std::vector<std::string>{"product a,b", "settling t", "step a", "step a"}));
  EXPECT_TRUE(std::ranges::all_of(missing.found, &FoundTerm::confirmed));
  EXPECT_LT(missing.gaps[0].after, 0.1);
}

// 0.5 a + 0.3 (a - a of the row before) is also 0.8 a - 0.3 (a of the row before), and 0.5 (a of the row before) + 0.8
// (a - a of the row before).
TEST(StandardTerms, TheRowItselfIsNamedBeforeTheRowBefore) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    Bench data = bench(seed, 300, 0.05, [](double, double a, double, double) { return 0.5 * a; });
    for (Eigen::Index i = 1; i < 300; ++i) {
      data.measured.values(i, 0) += 0.3 * (data.inputs.values(i, 1) - data.inputs.values(i - 1, 1));
    }
    const Missing missing = missing_from(data);
    EXPECT_EQ(missing.answer, Answer::named) << seed;
    ASSERT_EQ(missing.found.size(), 2U) << seed;
    EXPECT_EQ(missing.found[0].family, "linear") << seed;
    EXPECT_EQ(missing.found[1].family, "rate") << seed;
    EXPECT_NEAR(missing.found[0].coefficients(0), 0.5, 0.02) << seed;
    EXPECT_NEAR(missing.found[1].coefficients(0), 0.3, 0.02) << seed;
  }
}

TEST(StandardTerms, OutliersAreRowsAndNotTerms) {
  Bench data = bench(6, 200, 0.05, [](double, double a, double, double) { return 0.1 * a * a; });
  MissingOptions options;
  options.held_out_share = 0.0;
  for (const Eigen::Index row : {12, 80, 151}) data.measured.values(row, 0) += 3.0;
  const Missing missing = missing_from(data, options);
  std::vector<Eigen::Index> outliers = missing.outliers;
  std::ranges::sort(outliers);
  EXPECT_EQ(outliers, (std::vector<Eigen::Index>{12, 80, 151}));
  ASSERT_EQ(missing.found.size(), 1U);
  EXPECT_EQ(missing.found[0].family, "square");
  EXPECT_NEAR(missing.found[0].coefficients(0), 0.1, 0.003);
}

TEST(StandardTerms, RowsSetAsideTakeNoPart) {
  const Bench data = bench(9, 150, 0.05, [](double, double a, double, double) { return 0.1 * a * a; });
  const Missing first = missing_from(data);
  EXPECT_EQ(first.held_out.size(), 30U);
  EXPECT_EQ(first.searched.size(), 120U);
  Bench spoilt = data;
  for (const Eigen::Index row : first.held_out) spoilt.measured.values(row, 0) = 1e6;
  const Missing second = missing_from(spoilt);
  // The search does not see them, and the estimates, which are of all rows, leave out what fits nothing.
  EXPECT_EQ(first.verdict.score_gain, second.verdict.score_gain);
  EXPECT_EQ(first.candidates, second.candidates);
  ASSERT_EQ(first.found.size(), second.found.size());
  EXPECT_EQ(first.found[0].family, second.found[0].family);
  EXPECT_NEAR(first.found[0].values[0].value, second.found[0].values[0].value,
              2.0 * second.found[0].values[0].standard_error);
  MissingOptions other;
  other.seed = 2;
  EXPECT_NE(missing_from(data, other).held_out, first.held_out);
}

TEST(StandardTerms, EqualInputsAreRepeatsAndStayTogether) {
  Bench data = bench(2, 160, 0.05, [](double, double, double, double) { return 0.0; });
  data.inputs.order = "t";
  for (Eigen::Index i = 1; i < 160; i += 2) {
    data.inputs.values.row(i).tail(2) = data.inputs.values.row(i - 1).tail(2);
    data.measured.values(i, 0) += data.simulated(i - 1, 0) - data.simulated(i, 0);
    data.simulated(i, 0) = data.simulated(i - 1, 0);
  }
  const Missing missing = missing_from(data);
  EXPECT_TRUE(missing.floor_from_repeats);
  EXPECT_NEAR(missing.gaps[0].noise_floor, 0.05, 0.02);
  for (const Eigen::Index row : missing.held_out) {
    EXPECT_NE(std::ranges::find(missing.held_out, row ^ 1), missing.held_out.end());
  }
}

/// R P (1 - exp(-t / tau)) of inputs t, P, with a third input that the simulation does not use.
Eigen::MatrixXd plate(const Eigen::MatrixXd& inputs, const Eigen::VectorXd& values) {
  return (values(0) * inputs.col(1).array() * (1.0 - (-inputs.col(0).array() / values(1)).exp())).matrix();
}

TEST(FindMissing, FitsTheSimulationTogetherWithItsTerms) {
  const int seeds = sampled(40, 12);
  int named = 0;
  Eigen::Vector3i covered = Eigen::Vector3i::Zero();
  for (std::uint64_t seed = 1; seed <= static_cast<std::uint64_t>(seeds); ++seed) {
    llmt::Random random(seed);
    Inputs inputs{{"t", "power", "draught"}, Eigen::MatrixXd(120, 3)};
    for (Eigen::Index i = 0; i < 120; ++i) {
      inputs.values.row(i) << random.uniform(0.0, 600.0), random.uniform(10.0, 50.0), random.uniform(0.0, 2.0);
    }
    MeasuredOutputs measured{{"T"}, plate(inputs.values, Eigen::Vector2d(0.82, 140.0))};
    for (Eigen::Index i = 0; i < 120; ++i) {
      measured.values(i, 0) += -0.03 * inputs.values(i, 1) * inputs.values(i, 2) + 0.1 * random.normal();
    }
    Simulation simulation{{{.name = "R", .unit = "K/W", .value = 1.0, .scale = 0.1},
                           {.name = "tau", .unit = "s", .value = 100.0, .scale = 10.0}},
                          plate};
    const std::vector<ModelTerm> terms = standard_terms(inputs);
    const Missing missing = find_missing(simulation, inputs, measured, terms);
    if (missing.found.size() != 1 || missing.found[0].location != "power,draught") continue;
    ++named;
    const TermValue& value = missing.found[0].values[0];
    covered(0) += std::abs(missing.parameters[0].value - 0.82) < 2.0 * missing.standard_errors(0) ? 1 : 0;
    covered(1) += std::abs(missing.parameters[1].value - 140.0) < 2.0 * missing.standard_errors(1) ? 1 : 0;
    covered(2) += std::abs(value.value + 0.03) < 2.0 * value.standard_error ? 1 : 0;
    // Where nothing was measured.
    Inputs elsewhere{inputs.names, Eigen::MatrixXd(2, 3)};
    elsewhere.values << 300.0, 40.0, 1.5, 50.0, 20.0, 0.1;
    const Eigen::VectorXd truth = plate(elsewhere.values, Eigen::Vector2d(0.82, 140.0)) -
                                  0.03 * elsewhere.values.col(1).cwiseProduct(elsewhere.values.col(2));
    EXPECT_LT((corrected(simulation, missing, terms, elsewhere) - truth).norm(), 0.2);
    EXPECT_LT((corrected(simulation, missing, terms, inputs) - missing.corrected).norm(), 1e-9);
  }
  EXPECT_GE(named, seeds * 9 / 10);
  // 95 % intervals: fewer than 85 % in 36 or more draws has a probability below 0.01, and the seeds are fixed.
  EXPECT_GE(covered.minCoeff(), named * 85 / 100);
}

TEST(FindMissing, OwnTermsRespectTheirLimitsAndTheirOutput) {
  Bench data = bench(5, 150, 0.05, [](double, double a, double b, double) { return -0.3 * std::sin(a) * b; });
  std::vector<ModelTerm> terms = {
      own_term("slip", "b sin(a)", [](const Eigen::VectorXd& row) { return row(2) * std::sin(row(1)); })};
  const auto find = [&] { return find_missing(tabulated(data.simulated, {"y"}), data.inputs, data.measured, terms); };
  ASSERT_EQ(find().found.size(), 1U);
  EXPECT_NEAR(find().found[0].coefficients(0), -0.3, 0.05);
  terms[0].lower = Eigen::VectorXd::Zero(1);
  terms[0].upper = Eigen::VectorXd::Ones(1);
  EXPECT_TRUE(find().found.empty());
  terms[0].lower.resize(0);
  terms[0].upper.resize(0);
  terms[0].output = "z";
  EXPECT_TRUE(find().found.empty());
}

TEST(FindMissing, MistakesAreNamed) {
  const Bench good = bench(1, 40, 0.05, [](double, double, double, double) { return 0.0; });
  const auto message = [](const Bench& data, std::vector<ModelTerm> terms = {}, const MissingOptions& options = {}) {
    try {
      for (ModelTerm& term : standard_terms(data.inputs)) terms.push_back(term);
      find_missing(tabulated(data.simulated, {"y"}), data.inputs, data.measured, terms, options);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_EQ(message(good), "accepted");
  const auto expect = [&](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  Bench bad = good;
  bad.inputs.names[1] = "t";
  expect(message(bad), "the input \"t\" is there twice");
  bad = good;
  bad.inputs.values(3, 1) = std::nan("");
  expect(message(bad), "the input \"a\" has a value that is not finite");
  bad = good;
  bad.inputs.order = "when";
  expect(message(bad), "the order \"when\" is not an input");
  bad = good;
  bad.inputs.order = "a";
  bad.inputs.values(1, 1) = bad.inputs.values(0, 1);
  expect(message(bad), "the order \"a\" has the value");
  bad = good;
  bad.measured.values(3, 0) = std::nan("");
  expect(message(bad), "a measured value of \"y\" is not finite");
  bad = good;
  bad.simulated(5, 0) = std::nan("");
  expect(message(bad), "the simulation is not finite at row 6");
  bad = good;
  bad.measured.values.conservativeResize(39, 1);
  expect(message(bad), "39 rows of measured outputs for 40 rows of inputs");
  expect(message(good, {own_term("slip", "1/0", [](const Eigen::VectorXd&) { return std::nan(""); })}),
         "the term slip is not finite at row 1");
  MissingOptions options;
  options.held_out_share = 1.5;
  expect(message(good, {}, options), "held_out_share is 1.5");
  expect(message(bench(1, 11, 0.05, [](double, double, double, double) { return 0.0; })), "too few");
}

}  // namespace
