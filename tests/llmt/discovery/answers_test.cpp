// What becomes of terms that were found: certain, tentative, or taken for others.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>

#include "discovery/answer/findings.hpp"
#include "discovery/answer/judges.hpp"
#include "discovery/search/replacements.hpp"
#include "discovery/terms/term_model.hpp"
#include "llmt/discovery/simulation.hpp"
#include "llmt/discovery/terms.hpp"
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
    judge_findings(missing, true);
    decide(missing);
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
    judge_findings(missing, true);
    decide(missing);
    return missing.found[0].confirmed;
  };
  EXPECT_TRUE(power_and_saturation({{"linear T", {"T"}, false}}));
  EXPECT_TRUE(power_and_saturation({{"offset", {}, false}}));
  EXPECT_FALSE(power_and_saturation({{"offset", {}, false}, {"linear T", {"T"}, false}}));
}

TEST(Answers, AWidthIsNotBelowTheErrorsOfItsInput) {
  constexpr Eigen::Index n = 1000;
  const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(n, -1.0, 1.0);
  Inputs inputs{{"v"}, x};
  inputs.instants = Eigen::VectorXd::LinSpaced(n, 0.0, 1.0);
  inputs.noise = Eigen::VectorXd::Constant(1, 0.01);
  const std::vector<ModelTerm> terms = standard_terms(inputs);
  const Recording recording(inputs);
  const auto stribeck =
      static_cast<std::size_t>(std::ranges::find(terms, "stribeck", &ModelTerm::family) - terms.begin());
  const auto is_too_narrow = [&](double width, double of_smoothed) {
    Missing missing = answer_with({found_term(stribeck, "stribeck", "v", 1.0, 0.01)});
    missing.found[0].constants = Eigen::VectorXd::Constant(1, width);
    return narrower_than_errors(missing, terms, recording, Eigen::VectorXd::Constant(1, of_smoothed))
        .contains(stribeck);
  };
  EXPECT_TRUE(is_too_narrow(0.039, 0.0));
  EXPECT_FALSE(is_too_narrow(0.041, 0.0));
  EXPECT_TRUE(is_too_narrow(0.041, 0.021));
  EXPECT_FALSE(is_too_narrow(0.041, 0.02));
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

// Several terms may cancel where they were fitted and nowhere else.
TEST(Answers, TermsThatAreNotCertainAddAtMostWhatTheyAddedWhereTheyWereFound) {
  const Inputs inputs{{"x"}, Eigen::VectorXd::LinSpaced(9, -2.0, 2.0)};
  const std::vector<ModelTerm> terms = standard_terms(inputs);
  const auto place = [&](const std::string& family) {
    return static_cast<std::size_t>(std::ranges::find(terms, family, &ModelTerm::family) - terms.begin());
  };
  Missing missing = answer_with(
      {found_term(place("square"), "square", "x", 1.0, 0.1), found_term(place("linear"), "linear", "x", -1.0, 0.1)});
  missing.gaps = {{.output = "y"}};
  missing.searched = {2, 3, 4, 5, 6};  // x of -1 to 1: x^2 - x is -.25 (at .5) to 2
  const Simulation simulation = tabulated(Eigen::MatrixXd::Zero(9, 1), {"y"});
  const Recording recording(inputs);
  missing.parameters = simulation.parameters;
  missing.range_of_terms = range_of_found_terms(simulation, missing, terms, recording);
  EXPECT_EQ(missing.range_of_terms(0, 0), -0.25);
  EXPECT_EQ(missing.range_of_terms(0, 1), 2.0);
  const Eigen::VectorXd x = inputs.values.col(0);
  const Eigen::VectorXd added = x.cwiseAbs2() - x;
  EXPECT_EQ(corrected(simulation, missing, terms, inputs).col(0), added.cwiseMin(2.0));
  for (FoundTerm& found : missing.found) found.confirmed = true;
  EXPECT_EQ(corrected(simulation, missing, terms, inputs).col(0), added);
}

}  // namespace
}  // namespace answers_test
