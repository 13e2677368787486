// Searches among fewer terms: when their answer is taken for what was found.
#include "discovery/terms/alternatives.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "llmt/discovery/simulation.hpp"
#include "noise.hpp"

namespace alternatives_test {
namespace {

using namespace llmt::discovery;

constexpr Eigen::Index rows = 400;
constexpr double noise = 0.1;

// y = 0.5 x^2 in time, of which the simulation has nothing.
struct Log {
  Inputs inputs{{"x"}, Eigen::MatrixXd(rows, 1)};
  Simulation simulation = tabulated(Eigen::MatrixXd::Zero(rows, 1), {"y"});
  MeasuredOutputs measured{{"y"}, Eigen::MatrixXd(rows, 1)};
  std::vector<ModelTerm> terms;

  explicit Log(std::uint64_t seed) {
    Noise random(seed);
    inputs.instants = Eigen::VectorXd::LinSpaced(rows, 0.0, 0.02 * (rows - 1));
    for (Eigen::Index i = 0; i < rows; ++i) {
      const double t = inputs.instants(i);
      inputs.values(i, 0) = 2.0 + std::sin(3.1 * t) + 0.5 * std::sin(7.7 * t + 1.0);
      measured.values(i, 0) = 0.5 * inputs.values(i, 0) * inputs.values(i, 0) + noise * random.normal();
    }
    terms = standard_terms(inputs);
  }

  double spread() const { return std::sqrt(measured.values.squaredNorm() / static_cast<double>(rows)); }
};

// An answer of one term that leaves `after` on the rows set aside.
Missing answer_of(const Log& log, const std::string& family, double after) {
  FoundTerm found;
  found.term = static_cast<std::size_t>(std::ranges::find(log.terms, family, &ModelTerm::family) - log.terms.begin());
  found.family = family;
  found.inputs = {"x"};
  found.generic = log.terms.at(found.term).generic;
  found.coefficients = Eigen::VectorXd::Ones(1);
  found.constants = Eigen::VectorXd::Ones(std::ssize(log.terms[found.term].constants));
  found.confirmed = true;
  Missing missing;
  missing.answer = Answer::named;
  missing.found = {found};
  for (Eigen::Index row = 0; row < rows; ++row) missing.held_out.push_back(row);
  missing.searched = missing.held_out;
  missing.corrected = (log.measured.values.array() + 1e-3).matrix();  // better than any, where it is not said otherwise
  missing.gaps = {{.output = "y", .before = log.spread(), .after = after, .noise_floor = noise}};
  return missing;
}

enum class Search { terms_for_state, causes_for_shapes, plain_for_searched };

Missing taken(const Log& log, const Missing& found, Search search) {
  const SearchedRows all;
  MissingOptions options;
  options.search.simplest_of_rivals = true;
  const std::set<std::size_t> refuted;
  const Alternatives alternatives{log.simulation, log.inputs, log.measured, log.terms, all, options, refuted};
  if (search == Search::terms_for_state) return alternatives.terms_for_state(found);
  if (search == Search::causes_for_shapes) return alternatives.causes_for_shapes(found);
  return alternatives.plain_for_searched(found);
}

std::string family_taken(const Log& log, const Missing& found, Search search) {
  const Missing answer = taken(log, found, search);
  EXPECT_EQ(answer.found.size(), 1u);
  return answer.found.at(0).family;
}

TEST(Alternatives, PlainTermsAreTakenWhereTheyLeaveClearlyLessOrNoMoreWithFewerNumbers) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const Log log(seed);
    constexpr Search plain = Search::plain_for_searched;
    const Missing of_square = taken(log, answer_of(log, "saturation", 2.0 * noise), plain);
    const double left = of_square.gaps[0].after;
    EXPECT_LT(left, 1.3 * noise);
    // 70 and 90 % of the squares.
    Missing clearly_more = answer_of(log, "saturation", left / std::sqrt(0.7));
    Missing more = answer_of(log, "saturation", left / std::sqrt(0.9));
    EXPECT_EQ(family_taken(log, clearly_more, plain), "square");
    EXPECT_EQ(family_taken(log, more, plain), "square");
    EXPECT_EQ(family_taken(log, answer_of(log, "saturation", 0.95 * left), plain), "saturation");
    EXPECT_EQ(family_taken(log, answer_of(log, "linear", 1.3 * noise), plain), "linear");
    // The square has one number too.
    for (Missing* missing : {&clearly_more, &more}) missing->found[0].coefficients.resize(0);
    EXPECT_EQ(family_taken(log, clearly_more, plain), "square");
    EXPECT_EQ(family_taken(log, more, plain), "saturation");
    // As good on the rows that both set aside, by the margin of a rival for so few rows and by that of all.
    const auto better_by = [&](double share) {
      Missing found = answer_of(log, "saturation", 0.95 * left);
      found.held_out = of_square.held_out;
      found.searched = of_square.searched;
      found.corrected = log.measured.values - (1.0 - share) * (log.measured.values - of_square.corrected);
      return taken(log, found, plain);
    };
    const Missing square = better_by(0.0);
    EXPECT_EQ(square.found[0].family, "square");
    ASSERT_EQ(square.found[0].rivals.size(), 1u);
    EXPECT_EQ(square.found[0].rivals[0].what, "saturation");
    EXPECT_EQ(square.answer, Answer::indistinguishable);
    const Missing saturation = better_by(0.04);
    EXPECT_EQ(saturation.found[0].family, "saturation");
    ASSERT_EQ(saturation.found[0].rivals.size(), 1u);
    EXPECT_EQ(saturation.found[0].rivals[0].what, "square x");
    EXPECT_TRUE(better_by(0.1).found[0].rivals.empty());
  }
}

TEST(Alternatives, TermsAreTakenForAStateWhereTheyLeaveNextToNothing) {
  const Log log(1);
  Missing of_state = answer_of(log, "linear", 0.5 * noise);  // how it stands in the answer is of no account
  EXPECT_EQ(family_taken(log, of_state, Search::terms_for_state), "linear");
  of_state.answer = Answer::inner_state;
  EXPECT_EQ(family_taken(log, of_state, Search::terms_for_state), "square");
  // Of a gap of the size of the noise a tenth is less than the square leaves.
  of_state.gaps[0].before = 2.0 * noise;
  EXPECT_EQ(family_taken(log, of_state, Search::terms_for_state), "linear");
}

TEST(Alternatives, CausesAreTakenForShapesWhereTheyLeaveAsLittle) {
  const Log log(1);
  const auto shape = std::ranges::find_if(log.terms, &ModelTerm::generic);
  ASSERT_NE(shape, log.terms.end());
  EXPECT_EQ(family_taken(log, answer_of(log, shape->family, noise), Search::causes_for_shapes), "square");
  Missing small = answer_of(log, shape->family, 0.5 * noise);
  small.gaps[0].before = noise;
  EXPECT_EQ(family_taken(log, small, Search::causes_for_shapes), shape->family);
}

}  // namespace
}  // namespace alternatives_test
