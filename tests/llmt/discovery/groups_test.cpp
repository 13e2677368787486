// Terms that explain as much in the place of one that was found.
#include "discovery/answer/one_search.hpp"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <set>
#include <span>
#include <string>

#include "discovery/answer/question.hpp"
#include "llmt/discovery/simulation.hpp"
#include "noise.hpp"

namespace groups_test {
namespace {

using namespace llmt::discovery;

// y = x + noise, x within -1 ... 1 and slow in time; found as linear x.
struct Table {
  static constexpr Eigen::Index n = 120;
  Inputs inputs{{"x"}, Eigen::VectorXd::LinSpaced(n, -1.0, 1.0)};
  Simulation simulation = tabulated(Eigen::MatrixXd::Zero(n, 1), {"y"});
  Eigen::VectorXd measured{n};
  std::vector<ModelTerm> terms;

  explicit Table(double noise) {
    Noise random(4);
    for (Eigen::Index i = 0; i < n; ++i) measured(i) = inputs.values(i, 0) + noise * random.normal();
    inputs.instants = Eigen::VectorXd::LinSpaced(n, 0.0, 1.0);
    terms = standard_terms(inputs);
  }

  Eigen::Index index_of(const std::string& family) const {
    return std::ranges::find(terms, family, &ModelTerm::family) - terms.begin();
  }

  Missing grouped() const {
    const Recording recording(inputs);
    const TermModel model(simulation, recording, {"y"}, terms);
    Samples samples;
    for (Eigen::Index i = 0; i < n; ++i) samples.add(std::span(&i, 1));
    const TermData data{.samples = samples,
                        .measured = measured,
                        .sigma = Eigen::VectorXd::Ones(1),
                        .stretches = std::vector<Eigen::Index>(n, 0)};
    const PlacedTerm placed{static_cast<std::size_t>(index_of("linear")), 0, {}, Eigen::VectorXd::Ones(1), 0.0};
    const TermFit fit = fit_terms(model, data, Eigen::Vector2d(0.0, 1.0), {placed});
    Missing missing;
    missing.answer = Answer::named;
    missing.found.resize(1);
    missing.found[0].confirmed = true;
    name_groups(model, data, fit, missing);
    return missing;
  }

  double left_by(const Eigen::VectorXd& column) const {
    return (measured - column * column.householderQr().solve(measured)).squaredNorm();
  }
};

std::set<std::string> rivals_of(const Missing& missing) {
  std::set<std::string> names;
  for (const RivalTerms& rival : missing.found.at(0).rivals) names.insert(rival.what);
  return names;
}

TEST(Groups, HoldTheTermsThatLeaveAsLittle) {
  const Table table(0.5);
  const Missing missing = table.grouped();
  const std::set<std::string> rivals = rivals_of(missing);
  const double own = table.left_by(table.inputs.values.col(0));
  int inside = 0;
  int outside = 0;
  for (const ModelTerm& term : table.terms) {
    if (!term.constants.empty() || term.generic || term.history || term.family == "linear" || !term.regime.empty() ||
        term.coefficients.size() != 1 || term.code.at(0).find("$s") != std::string::npos) {
      continue;
    }
    const Rows rows = rows_of(table.inputs, Eigen::VectorXd::Zero(Table::n));
    const double left = table.left_by(term.columns(rows, {}).col(0));
    const bool belongs = 0.5 * Table::n * std::log(left / own) <= 3.0;
    EXPECT_EQ(rivals.contains(term.family + (term.location.empty() ? "" : " " + term.location)), belongs)
        << term.family;
    (belongs ? inside : outside) += 1;
  }
  EXPECT_GE(inside, 1);
  EXPECT_GE(outside, 2);
  EXPECT_EQ(missing.answer, Answer::undecided);
}

TEST(Groups, AreTentativeWhereTheirFunctionsDiffer) {
  const Missing vague = Table(0.5).grouped();
  EXPECT_FALSE(vague.found[0].confirmed);
  ASSERT_EQ(vague.notes.size(), 1u);
  EXPECT_NE(vague.notes[0].find("rows like that one tell them apart"), std::string::npos);
  EXPECT_NE(vague.notes[0].find("most at x = "), std::string::npos);

  // Of little noise those that are left, as tanh with a large width, are the same function.
  const Missing clear = Table(0.01).grouped();
  EXPECT_TRUE(clear.found[0].confirmed);
  EXPECT_TRUE(clear.notes.empty());
  EXPECT_FALSE(rivals_of(clear).contains("cube x"));
  EXPECT_TRUE(rivals_of(Table(0.5).grouped()).size() > rivals_of(clear).size());
}

}  // namespace
}  // namespace groups_test
