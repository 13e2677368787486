#include "llmt/discovery/search.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <set>
#include <stdexcept>

#include "search_cases.hpp"

namespace {

using namespace search_cases;

/// What sine and polynomial causes and cosine shapes of one input make of `hidden`.
Case curve_case(std::uint64_t seed, Eigen::Index samples, double noise, const std::function<double(double)>& hidden) {
  llmt::Random random(seed);
  Case data;
  Eigen::VectorXd x(samples);
  for (double& value : x) value = random.uniform(-1.0, 1.0);
  data.evidence.jacobian = Eigen::MatrixXd::Ones(samples, 2);
  data.evidence.jacobian.col(1) = x;
  data.evidence.residuals.resize(samples);
  for (Eigen::Index i = 0; i < samples; ++i) data.evidence.residuals(i) = hidden(x(i)) + noise * random.normal();
  const auto add = [&](const std::string& family, Eigen::MatrixXd signature, bool generic) {
    EffectCandidate candidate;
    candidate.family = family;
    candidate.location = "x";
    candidate.signature = std::move(signature);
    candidate.generic = generic;
    data.candidates.push_back(std::move(candidate));
  };
  add("square", x.array().square(), false);
  add("cube", x.array().cube(), false);
  add("absolute", x.array().abs(), false);
  add("sign", x.array().sign(), false);
  add("wave2", (2.0 * std::numbers::pi * x.array()).sin(), false);
  Eigen::MatrixXd cosines(samples, 8);
  for (Eigen::Index m = 0; m < 8; ++m) {
    cosines.col(m) = (0.5 * std::numbers::pi * static_cast<double>(m + 1) * (x.array() + 1.0)).cos();
  }
  add("?smooth", cosines.leftCols(4), true);
  add("?fine", cosines, true);
  return data;
}

TEST(SearchVerdict, NoiseIsNotNamed) {
  constexpr int seeds = 400;
  int alarms = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    Case data = random_case(static_cast<std::uint64_t>(seed) * 7919, 40, 2, 6, 30, 8);
    const Verdict verdict = search(data.evidence, data.candidates);
    alarms += verdict.answer != Answer::nothing_missing ? 1 : 0;
  }
  // At the nominal 0.3 % more than 6 have a probability below 1e-3.
  EXPECT_LE(alarms, 6) << "false alarm rate above the nominal one";
}

TEST(SearchVerdict, HeavyTailsAreNotNamed) {
  constexpr int seeds = 200;
  int alarms = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    Case data = random_case(static_cast<std::uint64_t>(seed) * 104729, 60, 1, 4, 30, 8);
    llmt::Random random(static_cast<std::uint64_t>(seed));
    for (double& value : data.evidence.residuals) {
      double squares = 0.0;
      for (int k = 0; k < 4; ++k) squares += std::pow(random.normal(), 2);
      value /= std::sqrt(squares / 4.0);  // Student's t with 4 degrees of freedom
    }
    alarms += search(data.evidence, data.candidates).answer != Answer::nothing_missing ? 1 : 0;
  }
  EXPECT_LE(alarms, seeds * 2 / 100);
}

TEST(SearchVerdict, PlantedEffectsAreFoundWithTheirValues) {
  int exact = 0;
  constexpr int seeds = 100;
  for (int seed = 1; seed <= seeds; ++seed) {
    Case data = random_case(static_cast<std::uint64_t>(seed) + 31, 100, 1, 5, 24, 6);
    add_effect(data, 7, 1.0);
    add_effect(data, 14, -0.8);
    const Verdict verdict = search(data.evidence, data.candidates);
    std::set<std::size_t> found;
    for (const Finding& finding : verdict.findings) {
      for (const FindingTerm& term : finding.terms) {
        found.insert(term.candidate);
        if (term.candidate != 7 && term.candidate != 14) continue;
        for (Eigen::Index k = 0; k < term.values.size(); ++k) {
          EXPECT_NEAR(term.values(k), term.candidate == 7 ? 1.0 : -0.8, 5.0 * term.standard_errors(k));
        }
      }
    }
    exact += found == std::set<std::size_t>{7, 14} ? 1 : 0;
  }
  EXPECT_GE(exact, seeds * 95 / 100);
}

TEST(SearchVerdict, OutliersAreListedAndNotNamed) {
  constexpr int seeds = 100;
  int alarms = 0;
  int caught = 0;
  int dropped_wrongly = 0;
  const std::set<std::size_t> planted = {4, 30, 77};
  for (int seed = 1; seed <= seeds; ++seed) {
    Case data = random_case(static_cast<std::uint64_t>(seed) * 13, 100, 1, 4, 24, 6);
    const bool has_effect = seed % 2 == 0;
    if (has_effect) add_effect(data, 3, 1.0);
    for (const std::size_t i : planted) data.evidence.residuals(i) += i == 30 ? -30.0 : 25.0;
    const Verdict verdict = search(data.evidence, data.candidates);
    const bool right = has_effect ? verdict.findings.size() == 1 && verdict.findings[0].terms[0].candidate == 3
                                  : verdict.findings.empty();
    alarms += right ? 0 : 1;
    for (const std::size_t i : verdict.outliers) (planted.contains(i) ? caught : dropped_wrongly) += 1;
    for (const std::size_t i : verdict.outliers) EXPECT_EQ(verdict.remaining(i), 0.0);
  }
  EXPECT_LE(alarms, 3);
  EXPECT_EQ(caught, 3 * seeds);
  EXPECT_LE(dropped_wrongly, seeds / 20);
}

TEST(SearchVerdict, WhatIsNotInTheCatalogueIsNotNamed) {
  const std::vector<std::function<double(double)>> hidden = {
      [](double x) { return std::exp(-std::pow((x - 0.3) / 0.2, 2)); },
      [](double x) { return std::tanh(6.0 * (x + 0.4)); },
      [](double x) { return 1.0 / (1.2 + x); },
      [](double x) { return x > 0.37 ? 0.5 : 0.0; },
  };
  for (std::size_t k = 0; k < hidden.size(); ++k) {
    int named = 0;
    int unknown = 0;
    constexpr int seeds = 40;
    for (int seed = 1; seed <= seeds; ++seed) {
      const Case data = curve_case(static_cast<std::uint64_t>(seed), 150, 0.05, hidden[k]);
      const Verdict verdict = search(data.evidence, data.candidates);
      const bool confirmed = std::ranges::any_of(verdict.findings, &Finding::confirmed);
      named += confirmed ? 1 : 0;
      unknown += verdict.answer == Answer::unknown ? 1 : 0;
    }
    EXPECT_LE(named, seeds / 10) << "function " << k;
    EXPECT_GE(unknown, seeds * 9 / 10) << "function " << k;
  }
}

TEST(SearchVerdict, WhatIsInTheCatalogueIsNamedAlthoughShapesFitIt) {
  int exact = 0;
  constexpr int seeds = 60;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const Case data = curve_case(seed, 150, 0.05, [](double x) { return 0.4 * x * x; });
    const Verdict verdict = search(data.evidence, data.candidates);
    ASSERT_FALSE(verdict.findings.empty());
    EXPECT_EQ(verdict.findings[0].family, "square");
    EXPECT_TRUE(verdict.findings[0].confirmed);
    EXPECT_NEAR(verdict.noise, 0.05, 0.02);
    exact += verdict.findings.size() == 1 ? 1 : 0;
  }
  EXPECT_GE(exact, seeds * 95 / 100);
}

TEST(SearchVerdict, AnExactAliasIsAnExactRival) {
  Case data = random_case(3, 50, 2, 4, 8, 4);
  EffectCandidate alias = data.candidates[1];
  alias.family = "another cause";
  alias.signature *= -3.0;
  // The baseline does not see the difference either.
  alias.signature.col(0) += data.evidence.jacobian.col(2);
  data.candidates.push_back(alias);
  add_effect(data, 1, 1.0);
  const Verdict verdict = search(data.evidence, data.candidates);
  EXPECT_EQ(verdict.answer, Answer::indistinguishable);
  ASSERT_EQ(verdict.findings.size(), 1U);
  ASSERT_EQ(verdict.findings[0].rivals.size(), 1U);
  const Rival& rival = verdict.findings[0].rivals[0];
  EXPECT_TRUE(rival.exact);
  const std::set<std::string> both = {verdict.findings[0].family, rival.family};
  EXPECT_EQ(both, (std::set<std::string>{"another cause", data.candidates[1].family}));
}

TEST(SearchVerdict, WhatTheBaselineImitatesIsAbsorbed) {
  Case data = random_case(4, 50, 1, 4, 4, 4);
  data.candidates[2].signature = data.evidence.jacobian * Eigen::MatrixXd::Ones(4, 1);
  data.evidence.residuals += 50.0 * data.candidates[2].signature;
  const Verdict verdict = search(data.evidence, data.candidates);
  EXPECT_EQ(verdict.answer, Answer::nothing_missing);
  EXPECT_TRUE(verdict.sensitivity[2].absorbed);
  EXPECT_TRUE(std::isinf(verdict.sensitivity[2].visible(0)));
  EXPECT_FALSE(verdict.sensitivity[0].absorbed);
}

TEST(SearchVerdict, TheVisibleAmplitudeIsFoundNineTimesOfTen) {
  constexpr int seeds = 300;
  int found = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    Case data = random_case(static_cast<std::uint64_t>(seed) + 900, 100, 1, 4, 12, 6);
    const double visible = search(data.evidence, data.candidates).sensitivity[9].visible(0);
    data.evidence.residuals = normal_matrix(*std::make_unique<llmt::Random>(static_cast<std::uint64_t>(seed)), 100, 1);
    data.evidence.residuals += visible * data.candidates[9].signature.col(0);
    const Verdict verdict = search(data.evidence, data.candidates);
    found += verdict.answer != Answer::nothing_missing ? 1 : 0;
  }
  // Four standard deviations of a binomial proportion of 300.
  EXPECT_NEAR(static_cast<double>(found) / seeds, 0.9, 0.07);
}

TEST(SearchVerdict, IsTheSameTwiceAndAtAnyScale) {
  Case data = random_case(21, 60, 2, 5, 20, 5);
  add_effect(data, 4, 0.6);
  data.evidence.residuals(11) += 40.0;
  const Verdict first = search(data.evidence, data.candidates);
  const Verdict second = search(data.evidence, data.candidates);
  ASSERT_EQ(first.findings.size(), 1U);
  EXPECT_EQ(first.score_gain, second.score_gain);
  EXPECT_EQ(first.threshold, second.threshold);
  EXPECT_EQ(first.remaining, second.remaining);
  for (const double scale : {1e-14, 1e-6, 1e9}) {
    Evidence scaled = data.evidence;
    scaled.residuals *= scale;
    const Verdict verdict = search(scaled, data.candidates);
    ASSERT_EQ(verdict.findings.size(), 1U) << scale;
    EXPECT_EQ(verdict.findings[0].terms[0].candidate, 4U);
    EXPECT_EQ(verdict.outliers, first.outliers);
    EXPECT_NEAR(verdict.score_gain, first.score_gain, 1e-6);
    EXPECT_NEAR(verdict.findings[0].terms[0].values(0), scale * first.findings[0].terms[0].values(0), 1e-9 * scale);
  }
}

TEST(SearchVerdict, RepeatsTellScatterBeyondThem) {
  Case data = random_case(8, 90, 1, 3, 6, 3);
  for (Eigen::Index i = 0; i < 90; ++i) data.evidence.repeats.push_back(i / 3);
  const Verdict quiet = search(data.evidence, data.candidates);
  EXPECT_EQ(quiet.lack_of_fit.dof, 60);
  EXPECT_GT(quiet.lack_of_fit.p_value, 0.001);
  llmt::Random random(8);
  for (Eigen::Index group = 0; group < 30; ++group) {
    const double shift = 2.0 * random.normal();
    for (Eigen::Index k = 0; k < 3; ++k) data.evidence.residuals(3 * group + k) += shift;
  }
  const Verdict loud = search(data.evidence, data.candidates);
  EXPECT_LT(loud.lack_of_fit.p_value, 1e-4);
  EXPECT_NEAR(loud.lack_of_fit.noise, 1.0, 0.3);
}

TEST(SearchVerdict, DegenerateEvidenceHasAnAnswer) {
  Case data = random_case(2, 20, 1, 3, 5, 5);
  Case zero = data;
  zero.evidence.residuals.setZero();
  EXPECT_EQ(search(zero.evidence, zero.candidates).answer, Answer::nothing_missing);
  Case exact = data;
  exact.evidence.residuals = 2.0 * exact.candidates[0].signature.col(0);
  const Verdict found = search(exact.evidence, exact.candidates);
  ASSERT_EQ(found.findings.size(), 1U);
  EXPECT_EQ(found.findings[0].terms[0].candidate, 0U);
  EXPECT_EQ(search(data.evidence, {}).answer, Answer::nothing_missing);
  Case silent = data;
  silent.candidates[1].signature.setZero();
  EXPECT_TRUE(search(silent.evidence, silent.candidates).sensitivity[1].absorbed);
  for (const Eigen::Index parameters : {19, 20, 25}) {
    const Case full = random_case(2, 20, 1, parameters, 5, 5);
    EXPECT_EQ(search(full.evidence, full.candidates).answer, Answer::nothing_missing) << parameters;
  }
  const Case one = random_case(2, 1, 1, 0, 3, 3);
  EXPECT_EQ(search(one.evidence, one.candidates).answer, Answer::nothing_missing);
  // A candidate that lives on one sample, and that sample is off.
  Case lone = random_case(2, 60, 1, 3, 5, 5);
  lone.candidates[0].signature = Eigen::MatrixXd::Zero(60, 1);
  lone.candidates[0].signature(7, 0) = 1.0;
  lone.evidence.residuals(7) += 50.0;
  const Verdict verdict = search(lone.evidence, lone.candidates);
  EXPECT_TRUE(verdict.outliers == std::vector<std::size_t>{7} || verdict.findings.size() == 1);
}

TEST(SearchVerdict, ValuesStayWithinTheirLimits) {
  Case data = random_case(6, 80, 1, 3, 6, 6);
  add_effect(data, 0, -1.0);
  data.candidates[0].lower = Eigen::VectorXd::Zero(1);
  data.candidates[0].upper = Eigen::VectorXd::Constant(1, 10.0);
  for (const Finding& finding : search(data.evidence, data.candidates).findings) {
    EXPECT_NE(finding.terms[0].candidate, 0U);
  }
  data.candidates[0].lower(0) = -2.0;
  const Verdict verdict = search(data.evidence, data.candidates);
  ASSERT_FALSE(verdict.findings.empty());
  EXPECT_EQ(verdict.findings[0].terms[0].candidate, 0U);
}

TEST(SearchErrors, NameWhatIsWrong) {
  const Case good = random_case(1, 10, 2, 2, 3, 3);
  const auto message = [](const Case& data, const SearchOptions& options = {}) -> std::string {
    try {
      search(data.evidence, data.candidates, options);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "accepted";
  };
  Case bad = good;
  bad.evidence.components = 3;
  EXPECT_NE(message(bad).find("residuals has 20 entries, must be a multiple of 3"), std::string::npos);
  bad = good;
  bad.candidates[1].signature.conservativeResize(19, 1);
  EXPECT_NE(message(bad).find("signature of candidate family1@place0 is 19 x 1"), std::string::npos);
  bad = good;
  bad.candidates[0].signature(3, 0) = std::nan("");
  EXPECT_NE(message(bad).find("signature of candidate family0@place0 is not finite"), std::string::npos);
  bad = good;
  bad.evidence.residuals(0) = std::nan("");
  EXPECT_NE(message(bad).find("a residual is not finite"), std::string::npos);
  bad = good;
  bad.evidence.repeats = {1, 2};
  EXPECT_NE(message(bad).find("repeats has 2 entries, must be 10"), std::string::npos);
  SearchOptions options;
  options.false_alarm_rate = 0.5;
  EXPECT_NE(message(good, options).find("false_alarm_rate is 0.5"), std::string::npos);
}

}  // namespace
