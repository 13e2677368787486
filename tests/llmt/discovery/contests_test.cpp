// Answers among other terms: which of two stands, and when another is looked for.
#include "discovery/answer/contests.hpp"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <string>

#include "llmt/discovery/simulation.hpp"
#include "noise.hpp"

namespace contests_test {
namespace {

using namespace llmt::discovery;

constexpr Eigen::Index rows = 400;
constexpr double noise = 0.1;

// y = 0.5 x^2 + 0.3 x in time, of which the simulation has nothing.
struct Log {
  Inputs inputs{{"x"}, Eigen::MatrixXd(rows, 1)};
  Simulation simulation = tabulated(Eigen::MatrixXd::Zero(rows, 1), {"y"});
  MeasuredOutputs measured{{"y"}, Eigen::MatrixXd(rows, 1)};
  std::vector<ModelTerm> terms;

  Log() {
    Noise random(1);
    inputs.instants = Eigen::VectorXd::LinSpaced(rows, 0.0, 0.02 * (rows - 1));
    for (Eigen::Index i = 0; i < rows; ++i) {
      const double t = inputs.instants(i);
      const double x = 2.0 + std::sin(3.1 * t) + 0.5 * std::sin(7.7 * t + 1.0);
      inputs.values(i, 0) = x;
      measured.values(i, 0) = 0.5 * x * x + 0.3 * x + noise * random.normal();
    }
    terms = standard_terms(inputs);
    for (ModelTerm& term : regime_terms(inputs, terms)) terms.push_back(std::move(term));
    for (ModelTerm& term : inner_state_terms(inputs, measured.values, {"y"})) terms.push_back(std::move(term));
  }

  FoundTerm term(const std::string& family) const {
    FoundTerm found;
    found.term = static_cast<std::size_t>(std::ranges::find(terms, family, &ModelTerm::family) - terms.begin());
    const ModelTerm& own = terms.at(found.term);
    found.family = family;
    found.location = "x";
    found.inputs = own.inputs;
    found.generic = own.generic;
    found.inner_state = own.inner_state;
    found.coefficients = Eigen::VectorXd::Ones(1);
    found.constants = Eigen::VectorXd::Ones(std::ssize(own.constants));
    found.confirmed = true;
    return found;
  }

  // Of which `added` is added to the simulation everywhere.
  Missing answer(const std::vector<std::string>& families, double added = 1.0) const {
    Missing missing;
    missing.answer = Answer::named;
    for (const std::string& family : families) missing.found.push_back(term(family));
    missing.parameters = simulation.parameters;
    missing.before = Eigen::MatrixXd::Zero(rows, 1);
    missing.corrected = Eigen::MatrixXd::Constant(rows, 1, added);
    missing.gaps = {{.output = "y", .before = 1.0, .after = noise, .noise_floor = noise}};
    missing.time.in_time = true;
    return missing;
  }
};

TEST(CrossValidation, PredictsEveryStretchByAFitOfTheOthers) {
  const Log log;
  const Recording recording(log.inputs);
  const CrossValidation validation(log.simulation, recording, log.measured, log.terms, {.fewest_samples = rows}, {});
  const Eigen::MatrixXd errors = validation.errors(log.answer({"square", "linear"}), {});
  ASSERT_EQ(errors.rows(), rows);
  Eigen::MatrixXd columns(rows, 2);
  columns << log.inputs.values.col(0).cwiseAbs2(), log.inputs.values.col(0);
  for (int fold = 0; fold < 5; ++fold) {
    std::vector<Eigen::Index> used;
    std::vector<Eigen::Index> unused;
    for (Eigen::Index i = 0; i < rows; ++i) (i / 40 % 5 == fold ? unused : used).push_back(i);
    const Eigen::VectorXd fit =
        columns(used, Eigen::all).householderQr().solve(log.measured.values(used, Eigen::all).col(0));
    const Eigen::VectorXd left = log.measured.values(unused, Eigen::all).col(0) - columns(unused, Eigen::all) * fit;
    EXPECT_LT((errors(unused, Eigen::all) - left).norm(), 1e-6 * left.norm());
  }
}

double nats(const Eigen::MatrixXd& found, const Eigen::MatrixXd& other, double independent_share) {
  return advantage(found, other, Eigen::VectorXd::Ones(1), independent_share).log_likelihood;
}

TEST(CrossValidation, LikelihoodsAreThoseOfNormalNoise) {
  const Eigen::MatrixXd small = Eigen::MatrixXd::Constant(100, 1, 1.0);
  Eigen::MatrixXd large = Eigen::MatrixXd::Constant(100, 1, 2.0);
  EXPECT_NEAR(nats(large, small, 0.5), 25.0 * std::log(4.0), 1e-9);
  EXPECT_NEAR(nats(small, large, 0.5), -25.0 * std::log(4.0), 1e-9);
  // What both miss by far is no evidence; what one misses is.
  Eigen::MatrixXd other = small;
  other(0, 0) = large(0, 0) = 6.0;
  EXPECT_NEAR(nats(large, other, 1.0), 49.5 * std::log(4.0), 1e-9);
  other(0, 0) = 1.0;
  EXPECT_NEAR(nats(large, other, 1.0), 50.0 * std::log((99.0 * 4.0 + 36.0) / 100.0), 1e-9);
}

// The spread of the ratio over draws of normal noise, of noise that few samples carry, and where one of the two leaves
// little of what the other leaves.
TEST(CrossValidation, StandardErrorIsTheSpreadOverDraws) {
  constexpr Eigen::Index n = 400;
  constexpr int draws = 300;
  struct Kind {
    bool is_rare;
    double difference;
  };
  for (const auto& [is_rare, difference] : {Kind{false, 0.3}, Kind{true, 0.3}, Kind{false, 4.0}}) {
    Noise random(7);
    double sum = 0.0;
    double squares = 0.0;
    double variances = 0.0;
    for (int draw = 0; draw < draws; ++draw) {
      Eigen::MatrixXd other(n, 1);
      Eigen::MatrixXd found(n, 1);
      for (Eigen::Index i = 0; i < n; ++i) {
        other(i, 0) = random.normal() * (is_rare && i % 25 == 0 ? 5.0 : 1.0);
        found(i, 0) = other(i, 0) + difference * std::sin(0.7 * static_cast<double>(i));
      }
      const Advantage own = advantage(found, other, Eigen::VectorXd::Constant(1, 100.0), 1.0);
      sum += own.log_likelihood;
      squares += own.log_likelihood * own.log_likelihood;
      variances += own.standard_error * own.standard_error;
    }
    const double spread = std::sqrt(squares / draws - sum / draws * (sum / draws));
    // A standard deviation of 300 draws has a standard error of 4 %.
    EXPECT_NEAR(std::sqrt(variances / draws), spread, 0.15 * spread) << is_rare << " " << difference;
  }
}

TEST(CrossValidation, FewSamplesThatDecideAreNoProof) {
  Noise random(3);
  Eigen::MatrixXd found(500, 1);
  for (Eigen::Index i = 0; i < found.rows(); ++i) found(i, 0) = random.normal();
  Eigen::MatrixXd other = found;
  found(100, 0) = 20.0;
  found(300, 0) = 12.0;
  other(100, 0) = 1.0;
  other(300, 0) = 1.0;
  const Advantage own = advantage(found, other, Eigen::VectorXd::Constant(1, 100.0), 1.0);
  EXPECT_GT(own.log_likelihood, 100.0);
  EXPECT_LT(own.log_likelihood, 2.0 * own.standard_error);
}

TEST(Contests, TheLikelihoodDecides) {
  const Log log;
  const Missing found = log.answer({"saturation"});
  const Missing other = log.answer({"square"}, 2.0);
  EXPECT_EQ(better_of(found, other, {-2.1, 1.0}).found[0].family, "saturation");
  EXPECT_TRUE(better_of(found, other, {-2.1, 1.0}).found[0].rivals.empty());
  const Missing better = better_of(found, other, {2.1, 1.0});
  EXPECT_EQ(better.found[0].family, "square");
  EXPECT_EQ(better.answer, Answer::named);

  // A tentative answer takes the place of a tentative one, but makes a certain one tentative.
  Missing tentative = other;
  tentative.found[0].confirmed = false;
  const Missing doubted = better_of(found, tentative, {2.1, 1.0});
  EXPECT_EQ(doubted.found[0].family, "saturation");
  EXPECT_FALSE(doubted.found[0].confirmed);
  EXPECT_EQ(doubted.answer, Answer::unknown);
  EXPECT_EQ(better_of(doubted, tentative, {2.1, 1.0}).found[0].family, "square");
}

TEST(Contests, FewerNumbersHaveTheNameWhereRowsCannotTell) {
  const Log log;
  const Missing found = log.answer({"saturation"});  // two numbers
  const Missing other = log.answer({"square"}, 1.09);
  const Missing simpler = better_of(found, other, {-1.9, 1.0});
  ASSERT_EQ(simpler.found.size(), 1u);
  EXPECT_EQ(simpler.found[0].family, "square");
  ASSERT_EQ(simpler.found[0].rivals.size(), 1u);
  EXPECT_EQ(simpler.found[0].rivals[0].what, "saturation x");
  EXPECT_TRUE(simpler.found[0].confirmed);
  EXPECT_EQ(simpler.answer, Answer::indistinguishable);

  const Missing longer = better_of(found, log.answer({"square", "linear", "cube"}, 1.09), {1.9, 1.0});
  EXPECT_EQ(longer.found[0].family, "saturation");
  EXPECT_EQ(longer.found[0].rivals[0].what, "square x + linear x + cube x");
  EXPECT_TRUE(longer.found[0].confirmed);

  // Another function: rows elsewhere would tell, so neither is certain.
  const Missing differing = better_of(found, log.answer({"square"}, 1.11), {0.0, 1.0});
  EXPECT_EQ(differing.found[0].family, "square");
  EXPECT_FALSE(differing.found[0].confirmed);
  EXPECT_EQ(differing.answer, Answer::undecided);

  // Nothing has fewer numbers than anything, and no rival.
  Missing nothing = log.answer({});
  nothing.answer = Answer::nothing_missing;
  EXPECT_TRUE(better_of(found, nothing, {-1.9, 1.0}).found.empty());
  EXPECT_EQ(better_of(found, nothing, {-1.9, 1.0}).answer, Answer::nothing_missing);
  EXPECT_EQ(better_of(found, nothing, {-2.1, 1.0}).found.size(), 1u);
  nothing.answer = Answer::undecided;
  EXPECT_EQ(better_of(found, nothing, {-1.9, 1.0}).found.size(), 1u);

  // A threshold of 0 is no number.
  Missing beyond = log.answer({"linear"}, 1.09);
  beyond.found[0].regime = "x";
  beyond.found[0].constants = Eigen::VectorXd::Zero(1);
  const Missing two = log.answer({"square", "cube"});
  EXPECT_EQ(better_of(two, beyond, {0.0, 1.0}).found.size(), 1u);
  beyond.found[0].constants(0) = 0.5;
  EXPECT_EQ(better_of(two, beyond, {0.0, 1.0}).found.size(), 2u);

  // Terms of both have no rival.
  const Missing both = better_of(log.answer({"square", "saturation"}), log.answer({"square", "linear"}), {0.0, 1.0});
  EXPECT_EQ(both.found[0].family, "square");
  EXPECT_TRUE(both.found[0].rivals.empty());
  EXPECT_EQ(both.found[1].rivals[0].what, "saturation x");
}

// The families that the searches of contests leave out, of some that are looked for.
std::vector<std::string> left_out_for(const Log& log, const Missing& found, const std::set<std::size_t>& refuted = {}) {
  const Recording recording(log.inputs);
  const CrossValidation validation(log.simulation, recording, log.measured, log.terms, {.fewest_samples = rows}, {});
  std::vector<std::string> all;
  contested(
      found, log.terms, refuted, validation, [&](const std::vector<ModelTerm>&, const std::set<std::size_t>& left_out) {
        std::string families;
        for (const std::string family : {"delay", "linear", "saturation", "gain", "square"}) {
          const auto place = std::ranges::find_if(
              log.terms, [&](const ModelTerm& term) { return term.family == family && term.regime.empty(); });
          if (left_out.contains(static_cast<std::size_t>(place - log.terms.begin()))) families += family + " ";
        }
        const auto generic = std::ranges::find_if(log.terms, &ModelTerm::generic);
        const auto regime = std::ranges::find_if(log.terms, [](const ModelTerm& term) { return !term.regime.empty(); });
        if (left_out.contains(static_cast<std::size_t>(generic - log.terms.begin()))) families += "shapes ";
        if (left_out.contains(static_cast<std::size_t>(regime - log.terms.begin()))) families += "regimes ";
        all.push_back(families);
        return found;  // the same terms are no rival
      });
  return all;
}

// What stands where a search finds `other` beside `found`.
std::vector<std::string> families_after(const Log& log, const Missing& found, const Missing& other) {
  const Recording recording(log.inputs);
  const CrossValidation validation(log.simulation, recording, log.measured, log.terms, {.fewest_samples = rows}, {});
  const Missing after = contested(found, log.terms, terms_of_regimes(log.terms), validation,
                                  [&](const std::vector<ModelTerm>&, const std::set<std::size_t>&) { return other; });
  std::vector<std::string> families;
  for (const FoundTerm& term : after.found) families.push_back(term.family);
  return families;
}

TEST(Contests, TermsStandInThePlaceOfAShapeIfTheyAreCertain) {
  const Log log;
  using Families = std::vector<std::string>;
  const auto smooth = std::ranges::find_if(log.terms, [](const ModelTerm& term) {
    return term.generic && term.inputs == std::vector<std::string>{"x"} && term.constants.empty();
  });
  ASSERT_NE(smooth, log.terms.end());
  Missing shape = log.answer({smooth->family});
  shape.answer = Answer::unknown;
  shape.found[0].confirmed = false;
  shape.gaps[0].known_noise = noise;  // nothing is left for regimes
  shape.found[0].coefficients = Eigen::VectorXd::Ones(std::ssize(smooth->coefficients));
  Missing terms = log.answer({"square", "linear"});
  EXPECT_EQ(families_after(log, shape, terms), (Families{"square", "linear"}));
  terms.found[0].confirmed = false;
  EXPECT_EQ(families_after(log, shape, terms), Families{smooth->family});
  // A term that leaves much more does not, nor do no terms at all.
  EXPECT_EQ(families_after(log, shape, log.answer({"offset"})), Families{smooth->family});
  Missing none = log.answer({});
  none.answer = Answer::nothing_missing;
  EXPECT_EQ(families_after(log, shape, none), Families{smooth->family});
}

TEST(Contests, CertainTermsStandInThePlaceOfTentativeOnes) {
  const Log log;
  using Families = std::vector<std::string>;
  Missing tentative = log.answer({"cube"});
  tentative.answer = Answer::unknown;
  tentative.found[0].confirmed = false;
  tentative.gaps[0].known_noise = noise;  // nothing is left for regimes
  Missing terms = log.answer({"square", "linear"});
  EXPECT_EQ(families_after(log, tentative, terms), (Families{"square", "linear"}));
  terms.found[1].confirmed = false;
  EXPECT_EQ(families_after(log, tentative, terms), Families{"cube"});
}

TEST(Contests, EachAppliesToWhatItLeavesOut) {
  const Log log;
  using Searches = std::vector<std::string>;
  const std::string all = "delay linear saturation gain square shapes regimes ";
  const std::set<std::size_t> regimes = terms_of_regimes(log.terms);
  ASSERT_FALSE(regimes.empty());
  EXPECT_EQ(left_out_for(log, log.answer({"square"}), regimes), Searches{});
  EXPECT_EQ(left_out_for(log, log.answer({"saturation"}), regimes), Searches{"saturation regimes "});

  Missing of_state = log.answer({"delay"});
  of_state.answer = Answer::inner_state;
  EXPECT_EQ(left_out_for(log, of_state), (Searches{"delay ", all}));

  const std::string shape = std::ranges::find_if(log.terms, &ModelTerm::generic)->family;
  EXPECT_EQ(left_out_for(log, log.answer({"square", shape}), regimes)[0], "shapes regimes ");

  // Each of the terms of a tentative answer, then all with a constant. Of several, regimes are tried, then those of x,
  // with which deviations change their size.
  Missing tentative = log.answer({"square", "saturation"});
  tentative.found[0].confirmed = false;
  EXPECT_EQ(left_out_for(log, tentative, regimes),
            (Searches{"square regimes ", "saturation regimes ", "saturation regimes ", "", ""}));
  // Of more than four it is no longer one taken for another.
  tentative = log.answer({"square", "cube", "linear", "offset", "gain"});
  tentative.found[0].confirmed = false;
  EXPECT_EQ(left_out_for(log, tentative, regimes), (Searches{"", ""}));

  // Something is left: regimes are no longer left out.
  Missing unknown = log.answer({"square"});
  unknown.answer = Answer::unknown;
  EXPECT_EQ(left_out_for(log, unknown, regimes), (Searches{"", ""}));
  unknown.gaps[0].known_noise = noise;
  EXPECT_EQ(left_out_for(log, unknown, regimes), Searches{});
  // So they are beside a term that is certain, where more is left than the noise, as far as that is known.
  Missing certain = log.answer({"square"});
  certain.gaps[0].known_noise = 0.5 * certain.gaps[0].after;
  EXPECT_EQ(left_out_for(log, certain, regimes), (Searches{"", ""}));

  // A step is an offset in a regime: in its place all terms are tried that act beyond a threshold of its input.
  unknown = log.answer({"step"});
  EXPECT_EQ(left_out_for(log, unknown, regimes), Searches{"saturation regimes "});
  unknown.answer = Answer::unknown;
  EXPECT_EQ(left_out_for(log, unknown, regimes), (Searches{"saturation regimes ", "", "", "", ""}));
}

}  // namespace
}  // namespace contests_test
