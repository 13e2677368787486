// What becomes of terms that were found: certain, tentative, or taken for others.
#include <gtest/gtest.h>

#include <algorithm>
#include <span>
#include <string>
#include <utility>

#include "discovery/search/replacements.hpp"
#include "discovery/terms/approximations.hpp"
#include "discovery/terms/missing_findings.hpp"
#include "llmt/discovery/simulation.hpp"
#include "search_cases.hpp"

namespace answers_test {
namespace {

using namespace llmt::discovery;

FoundTerm found_term(std::size_t index, std::string family, std::string input, double value, double standard_error) {
  FoundTerm found;
  found.term = index;
  found.family = std::move(family);
  found.location = input;
  if (!input.empty()) found.inputs = {input};
  found.output = "y";
  found.coefficients = Eigen::VectorXd::Constant(1, value);
  found.values = {{"coefficient", "", value, standard_error}};
  found.share = 0.5;
  return found;
}

Missing answer_with(std::vector<FoundTerm> found) {
  Missing missing;
  missing.answer = Answer::named;
  missing.verdict.answer = Answer::named;
  missing.found = std::move(found);
  return missing;
}

TEST(Answers, AnOffsetBesideAPowerIsTentativeWhereAFunctionOfTheInputCouldStandForIt) {
  const auto power_and_offset = [](std::vector<RivalTerms> rivals) {
    Missing missing = answer_with({found_term(0, "cube", "T", 1.0, 0.01), found_term(1, "offset", "", -3.0, 0.1)});
    missing.found[1].rivals = std::move(rivals);
    decide(missing, true);
    for (const std::string& note : missing.notes) EXPECT_NE(note.find("of T: together"), std::string::npos) << note;
    return missing.found[0].confirmed && missing.found[1].confirmed;
  };
  EXPECT_TRUE(power_and_offset({}));
  EXPECT_TRUE(power_and_offset({{"linear p", {"p"}, false}}));
  EXPECT_FALSE(power_and_offset({{"root T", {"T"}, false}}));
}

// A saturation that is nearly constant is an offset with another name.
TEST(Answers, ATermForWhichAnOffsetCouldStandCountsAsOneBesideAPower) {
  const auto power_and_saturation = [](std::vector<RivalTerms> rivals) {
    Missing missing = answer_with({found_term(0, "cube", "T", 1.0, 0.01), found_term(1, "saturation", "fan", -3, 0.1)});
    missing.found[1].rivals = std::move(rivals);
    decide(missing, true);
    return missing.found[0].confirmed;
  };
  EXPECT_TRUE(power_and_saturation({{"linear T", {"T"}, false}}));
  EXPECT_TRUE(power_and_saturation({{"offset", {}, false}}));
  EXPECT_FALSE(power_and_saturation({{"offset", {}, false}, {"linear T", {"T"}, false}}));
}

TEST(Answers, ATermIsTentativeIfTheIntervalOfItsCoefficientReachesZero) {
  const auto is_confirmed = [](double standard_error) {
    Missing missing = answer_with({found_term(0, "cube", "a", -1.0, standard_error)});
    decide(missing, true);
    return missing.found[0].confirmed;
  };
  EXPECT_TRUE(is_confirmed(0.5));
  EXPECT_FALSE(is_confirmed(0.52));
}

TEST(Answers, TermsOfOneInputThatNearlyCancelAreTentative) {
  const auto is_confirmed = [](bool cancels) {
    Missing missing = answer_with({found_term(0, "sign", "v", 1.3, 0.01), found_term(1, "tanh", "v", -1.3, 0.01)});
    decide(missing, true, {cancels, cancels});
    EXPECT_EQ(missing.notes.empty(), missing.found[0].confirmed);
    return missing.found[0].confirmed && missing.found[1].confirmed;
  };
  EXPECT_TRUE(is_confirmed(false));
  EXPECT_FALSE(is_confirmed(true));
}

TEST(Answers, ASignAndATanhOfTheOtherSignNearlyCancel) {
  constexpr Eigen::Index n = 201;
  const Inputs inputs{{"v"}, Eigen::VectorXd::LinSpaced(n, -1.0, 1.0)};
  const Simulation simulation = tabulated(Eigen::MatrixXd::Zero(n, 1), {"y"});
  const std::vector<ModelTerm> terms = standard_terms(inputs);
  const TermModel model(simulation, inputs, {"y"}, terms);
  Samples samples;
  for (Eigen::Index i = 0; i < n; ++i) samples.add(std::span(&i, 1));
  const TermData data{
      .samples = samples, .measured = Eigen::MatrixXd::Zero(n, 1), .sigma = Eigen::VectorXd::Ones(1), .stretches = {}};
  const auto placed = [&](const std::string& family, double value, double width) {
    const auto own = std::ranges::find(terms, family, &ModelTerm::family) - terms.begin();
    FoundTerm term = found_term(static_cast<std::size_t>(own), family, "v", value, 0.01);
    term.constants = Eigen::VectorXd::Constant(std::ssize(terms[own].constants), width);
    return term;
  };
  const Eigen::VectorXd nominal = Eigen::Vector2d(0.0, 1.0);
  const auto cancels = [&](const std::vector<FoundTerm>& found) {
    return cancelling_terms(model, data, nominal, found);
  };
  // 1 - tanh(v / 0.1) has a mean square of about 0.04, 1 + tanh(v / 0.1) one of nearly 4.
  EXPECT_EQ(cancels({placed("sign", 1.0, 0.0), placed("tanh", -1.0, 0.1)}), (std::vector<bool>{true, true}));
  EXPECT_EQ(cancels({placed("sign", 1.0, 0.0), placed("tanh", 1.0, 0.1)}), (std::vector<bool>{false, false}));
  EXPECT_EQ(cancels({placed("tanh", 1.0, 0.1)}), (std::vector<bool>{false}));
}

TEST(Answers, AWidthIsNotBelowTheErrorsOfItsInput) {
  constexpr Eigen::Index n = 1000;
  const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(n, -1.0, 1.0);
  Inputs inputs{{"v"}, x};
  inputs.instants = Eigen::VectorXd::LinSpaced(n, 0.0, 1.0);
  inputs.noise = Eigen::VectorXd::Constant(1, 0.01);
  const std::vector<ModelTerm> terms = standard_terms(inputs);
  const auto stribeck =
      static_cast<std::size_t>(std::ranges::find(terms, "stribeck", &ModelTerm::family) - terms.begin());
  const auto is_too_narrow = [&](double width, double of_smoothed) {
    Missing missing = answer_with({found_term(stribeck, "stribeck", "v", 1.0, 0.01)});
    missing.found[0].constants = Eigen::VectorXd::Constant(1, width);
    return narrower_than_errors(missing, terms, inputs, Eigen::VectorXd::Constant(1, of_smoothed)).contains(stribeck);
  };
  EXPECT_TRUE(is_too_narrow(0.039, 0.0));
  EXPECT_FALSE(is_too_narrow(0.041, 0.0));
  EXPECT_TRUE(is_too_narrow(0.041, 0.021));
  EXPECT_FALSE(is_too_narrow(0.041, 0.02));
}

TEST(Answers, ASearchedTermWhoseSizeIsNotKnownToAQuarterIsTentative) {
  const auto is_confirmed = [](double standard_error, bool has_constant) {
    FoundTerm peak = found_term(0, "stribeck", "v", 1.2, standard_error);
    if (has_constant) {
      peak.constants = Eigen::VectorXd::Constant(1, 0.1);
      peak.values.push_back({"c", "v", 0.1, 0.01});
    }
    Missing missing = answer_with({peak});
    decide(missing, true);
    EXPECT_EQ(missing.notes.empty(), missing.found[0].confirmed);
    return missing.found[0].confirmed;
  };
  EXPECT_TRUE(is_confirmed(0.15, true));
  EXPECT_FALSE(is_confirmed(0.16, true));
  EXPECT_TRUE(is_confirmed(0.16, false));
}

TEST(Answers, OneHingeStandsForAHingeAtTheOtherSideWithALineAndAnOffset) {
  llmt::Random random(3);
  constexpr Eigen::Index n = 400;
  search_cases::Case data;
  data.evidence.components = 1;
  data.evidence.jacobian = Eigen::MatrixXd(n, 0);
  const Eigen::ArrayXd x = Eigen::ArrayXd::LinSpaced(n, -1.0, 1.0);
  const auto add = [&](const std::string& family, int complexity, const Eigen::ArrayXd& signature) {
    EffectCandidate candidate;
    candidate.family = family;
    candidate.location = family == "offset" ? "" : "x";
    candidate.signature = signature.matrix();
    candidate.complexity = complexity;
    data.candidates.push_back(std::move(candidate));
  };
  add("offset", 1, Eigen::ArrayXd::Ones(n));
  add("linear", 2, x);
  add("hinge_below", 8, (0.25 - x).max(0.0));
  add("hinge", 8, (x - 0.25).max(0.0));
  data.evidence.residuals = 12.0 * data.candidates[3].signature + search_cases::normal_matrix(random, n, 1);
  SearchOptions options;
  options.simplest_of_rivals = true;
  const Workspace workspace(data.evidence, data.candidates, options.absorbed_tolerance);
  const Scoring scoring(workspace, data.candidates);
  EXPECT_EQ(least_complex(scoring, {0, 1, 2}, options), Set{3});
}

}  // namespace
}  // namespace answers_test
