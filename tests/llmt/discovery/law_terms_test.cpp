#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "discovery/answer/findings.hpp"
#include "llmt/discovery/simulation.hpp"
#include "llmt/random.hpp"
#include "study.hpp"

namespace law_terms_test {
namespace {

using namespace llmt::discovery;

using Hidden = std::function<double(double v, double q, double x, double y)>;

double sign(double value) { return value > 0.0 ? 1.0 : -1.0; }

/// Speeds v in -2 ... 2, angles q in -2.5 ... 2.5, loads x in 0 ... 6, a simulation 1 + 2 v - 0.5 x.
Missing missing_from(std::uint64_t seed, double noise, const Hidden& hidden) {
  constexpr Eigen::Index rows = 300;
  llmt::Random random(seed);
  const Inputs inputs{{"v", "q", "x"}, [&] {
                        Eigen::MatrixXd values(rows, 3);
                        for (Eigen::Index i = 0; i < rows; ++i) {
                          values.row(i) << random.uniform(-2.0, 2.0), random.uniform(-2.5, 2.5),
                              random.uniform(0.0, 6.0);
                        }
                        return values;
                      }()};
  Eigen::MatrixXd simulated(rows, 1);
  MeasuredOutputs measured{{"y"}, Eigen::MatrixXd(rows, 1)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    const Eigen::RowVector3d row = inputs.values.row(i);
    const double y = 1.0 + 2.0 * row(0) - 0.5 * row(2);
    simulated(i, 0) = y;
    measured.values(i, 0) = y + hidden(row(0), row(1), row(2), y) + noise * random.normal();
  }
  return find_missing(tabulated(simulated, {"y"}), inputs, measured, standard_terms(inputs));
}

struct Law {
  const char* family;
  const char* location;
  Hidden hidden;
  std::vector<double> values;  // coefficients, then constants
};

TEST(LawTerms, HiddenOnesAreNamedWithTheirConstants) {
  const std::vector<Law> laws = {
      {"coulomb_stribeck",
       "v",
       [](double v, double, double, double) { return sign(v) * (0.4 + 0.6 * std::exp(-std::pow(v / 0.4, 2))); },
       {0.4, 0.6, 0.4}},
      {"sigmoid",
       "x",
       [](double, double, double x, double) { return 0.5 / (1.0 + std::exp(-(x - 2.4) / 0.37)); },
       {0.5, 2.4, 0.37}},
      {"hill",
       "x",
       [](double, double, double x, double) { return 0.8 * std::pow(x, 3) / (8.0 + std::pow(x, 3)); },
       {0.8, 2.0, 3.0}},
      {"sigmoid",
       "v",
       [](double v, double, double, double) { return 0.5 / (1.0 + std::exp((v + 0.3) / 0.2)); },
       {0.5, -0.3, 0.2}},
      {"hill", "x", [](double, double, double x, double) { return 0.8 * 2.25 / (2.25 + x * x); }, {0.8, 1.5, 2.0}},
      {"power", "x", [](double, double, double x, double) { return 0.2 * std::pow(x, 1.42); }, {0.2, 1.42}},
      {"limit", "v", [](double v, double, double, double) { return 0.4 * std::clamp(v, -0.7, 0.7); }, {0.4, 0.7}},
      {"dead_band",
       "v",
       [](double v, double, double, double) { return 0.5 * sign(v) * std::max(0.0, std::abs(v) - 0.8); },
       {0.5, 0.8}},
      {"signed_power",
       "v",
       [](double v, double, double, double) { return 0.3 * sign(v) * std::sqrt(std::abs(v)); },
       {0.3, 0.5}},
      {"harmonic1",
       "q",
       [](double, double q, double, double) { return 0.4 * std::sin(q) + 0.2 * std::cos(q); },
       {0.2, 0.4}},
      {"load_friction", "v", [](double v, double, double, double y) { return 0.1 * sign(v) * std::abs(y); }, {0.1}},
      {"sign_product", "v,x", [](double v, double, double x, double) { return 0.1 * sign(v) * x; }, {0.1}},
      {"sign_product", "v,q", [](double v, double q, double, double) { return 0.3 * sign(v) * std::abs(q); }, {0.3}},
  };
  const int seeds = sampled(2, 1);
  for (const Law& law : laws) {
    int right = 0;
    const std::string name = std::string(law.family) + " " + law.location;
    for (std::uint64_t seed = 1; seed <= static_cast<std::uint64_t>(seeds); ++seed) {
      const Missing missing = missing_from(seed, 0.03, law.hidden);
      if (missing.found.size() != 1 || missing.found[0].family != law.family ||
          missing.found[0].location != law.location) {
        continue;
      }
      ++right;
      EXPECT_TRUE(missing.found[0].confirmed) << name;
      const std::vector<TermValue>& values = missing.found[0].values;
      ASSERT_EQ(values.size(), law.values.size());
      for (std::size_t k = 0; k < values.size(); ++k) {
        EXPECT_NEAR(values[k].value, law.values[k], 5.0 * values[k].standard_error) << name << " " << values[k].name;
        EXPECT_LT(values[k].standard_error, 0.25 * std::abs(law.values[k])) << name << " " << values[k].name;
      }
    }
    EXPECT_EQ(right, seeds) << name;
  }
}

// What the laws contain, or come close to, keeps its own name.
TEST(LawTerms, SimplerTermsKeepTheirNames) {
  const std::vector<Law> laws = {
      {"sign", "v", [](double v, double, double, double) { return 0.4 * sign(v); }, {0.4}},
      {"stribeck",
       "v",
       [](double v, double, double, double) { return 0.6 * sign(v) * std::exp(-std::pow(v / 0.4, 2)); },
       {0.6, 0.4}},
      {"tanh", "v", [](double v, double, double, double) { return 0.5 * std::tanh(v / 0.5); }, {0.5, 0.5}},
      {"square", "x", [](double, double, double x, double) { return 0.03 * x * x; }, {0.03}},
      {"root", "x", [](double, double, double x, double) { return 0.3 * std::sqrt(x); }, {0.3}},
      {"linear", "x", [](double, double, double x, double) { return 0.1 * x; }, {0.1}},
      {"step", "x", [](double, double, double x, double) { return x > 2.0 ? 0.4 : 0.0; }, {0.4, 2.0}},
      {"saturation", "x", [](double, double, double x, double) { return x / (1.5 + x); }, {1.0, 1.5}},
      {"product", "v,x", [](double v, double, double x, double) { return 0.05 * v * x; }, {0.05}},
  };
  const int seeds = sampled(2, 1);
  for (const Law& law : laws) {
    int right = 0;
    for (std::uint64_t seed = 1; seed <= static_cast<std::uint64_t>(seeds); ++seed) {
      const Missing missing = missing_from(seed, 0.03, law.hidden);
      right += missing.found.size() == 1 && missing.found[0].family == law.family && missing.found[0].confirmed ? 1 : 0;
    }
    EXPECT_EQ(right, seeds) << law.family;
  }
}

// Coulomb's and viscous friction are two terms, each with its coefficient.
TEST(LawTerms, CoulombAndViscousFrictionAreTwoTerms) {
  const std::uint64_t seeds = sampled(4, 1);
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const Missing missing =
        missing_from(seed, 0.03, [](double v, double, double, double) { return 0.4 * sign(v) + 0.3 * v; });
    ASSERT_EQ(missing.found.size(), 2U);
    std::vector<std::string> names = {missing.found[0].family, missing.found[1].family};
    std::ranges::sort(names);
    EXPECT_EQ(names, (std::vector<std::string>{"linear", "sign"}));
    EXPECT_TRUE(std::ranges::all_of(missing.found, &FoundTerm::confirmed));
    EXPECT_EQ(missing.answer, Answer::named);
  }
}

// Their code has no other values of c: below zero they would be an offset and dry friction under a wrong name.
TEST(LawTerms, NoLimitAndNoDeadBandEndsBelowZero) {
  const Inputs inputs{{"v"}, Eigen::VectorXd::LinSpaced(41, -2.0, 2.0)};
  const Rows rows{.inputs = inputs.values, .simulated = Eigen::VectorXd::Zero(41), .sequence = {}, .instants = {}};
  for (const ModelTerm& term : standard_terms(inputs)) {
    if (term.family != "limit" && term.family != "dead_band") continue;
    const auto column = [&](double c) -> Eigen::ArrayXd {
      return term.columns(rows, Eigen::VectorXd::Constant(1, c)).col(0);
    };
    EXPECT_FALSE(column(-0.3).allFinite()) << term.family;
    for (Eigen::Index i = 0; i < 41; ++i) {
      const double v = inputs.values(i);
      const double limited = std::clamp(v, -0.3, 0.3);
      EXPECT_DOUBLE_EQ(column(0.3)(i), term.family == "limit" ? limited : v - limited) << term.family << " " << v;
    }
  }
}

// What the formula says holds for other rows too, which may begin earlier: exp(-(t - 5) / 3), whatever t is.
TEST(LawTerms, ASettlingGoesOnBelowTheSmallestInput) {
  const Inputs inputs{{"t"}, Eigen::VectorXd::LinSpaced(41, 5.0, 25.0)};
  const std::vector<ModelTerm> terms = standard_terms(inputs);
  const auto settling = std::ranges::find(terms, "settling", &ModelTerm::family);
  ASSERT_NE(settling, terms.end());
  const Eigen::VectorXd times = Eigen::VectorXd::LinSpaced(11, 0.0, 10.0);
  const Rows rows{.inputs = times, .simulated = Eigen::VectorXd::Zero(11), .sequence = {}, .instants = {}};
  const Eigen::VectorXd column = settling->columns(rows, Eigen::VectorXd::Constant(1, 3.0)).col(0);
  for (Eigen::Index i = 0; i < 11; ++i) EXPECT_DOUBLE_EQ(column(i), std::exp((5.0 - times(i)) / 3.0)) << times(i);
  EXPECT_EQ(settling->code, std::vector<std::string>{"exp(-($1 - (5))/$c)"});
}

TEST(LawTerms, AnglesAreKnownByTheirNamesAndRanges) {
  const auto has_harmonics = [](const std::string& name, double range) {
    const Inputs inputs{{name}, Eigen::VectorXd::LinSpaced(50, -0.5 * range, 0.5 * range)};
    const std::vector<ModelTerm> terms = standard_terms(inputs);
    return std::ranges::any_of(terms, [](const ModelTerm& term) { return term.family == "harmonic1"; });
  };
  for (const char* name : {"q", "q1", "q_2", "theta", "phi3", "angle", "motor_angle", "swing_rad", "swing_deg"}) {
    EXPECT_TRUE(has_harmonics(name, 5.0)) << name;
  }
  for (const char* name : {"dq", "ddq1", "x", "load", "speed", "quality"})
    EXPECT_FALSE(has_harmonics(name, 5.0)) << name;
  EXPECT_FALSE(has_harmonics("q", 0.6));
  EXPECT_FALSE(has_harmonics("q", 300.0));
  EXPECT_TRUE(has_harmonics("q_deg", 300.0));
}

TEST(Gap, LeavesOutliersOutOfBothErrors) {
  Eigen::VectorXd before = Eigen::VectorXd::Constant(20, 0.3);
  Eigen::VectorXd after = Eigen::VectorXd::Constant(20, 0.1);
  before(4) = 5.0;
  after(4) = 4.8;
  const Gap gap = gap_of("y", before, before, after, 0.1);
  EXPECT_EQ(gap.outliers, 1);
  EXPECT_NEAR(gap.before, 0.3, 1e-12);
  EXPECT_NEAR(gap.after, 0.1, 1e-12);
  // What only the terms throw off counts.
  before(4) = 0.3;
  after(4) = 100.0;
  EXPECT_EQ(gap_of("y", before, before, after, 0.1).outliers, 0);
  EXPECT_GT(gap_of("y", before, before, after, 0.1).after, 20.0);
  EXPECT_TRUE(std::isnan(gap_of("y", {}, {}, {}, 0.1).after));
}

}  // namespace
}  // namespace law_terms_test
