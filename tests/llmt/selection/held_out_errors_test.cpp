// Errors of candidates on held-out rows, beside those of models that are made and asked by themselves.
#include "selection/held_out_errors.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>
#include <vector>

#include "llmt/selection/folded_problem.hpp"
#include "oracles/oracles.hpp"

namespace {

using folded_problem::one_output;
using folded_problem::Problem;

TEST(HeldOutErrors, HaveTheFormsLeafCountsAndErrorsOfTheirCandidates) {
  const Eigen::MatrixXd x = oracle::uniform(300, 3, 9);
  Problem problem(x, oracle::curved(x, 0.1, 9), 12);
  // Jumps as if they were: 4 and 1 are apart from 0.25 in all folds.
  for (llmt::GrownTree& tree : problem.trees) {
    tree.jumps.setConstant(0.25);
    tree.jumps(0) = 4.0;
    tree.jumps(2) = 1.0;
  }
  const llmt::Candidates candidates = {.widths = {0.5, 1.0, 2.0},
                                       .jumps = {llmt::no_jump, 8.0, 2.0, 1.5, 0.5, 0.1},
                                       .ridges = {1e-4, 1e-2},
                                       .shrinkages = {0.0}};
  llmt::Work uncounted;
  llmt::HeldOutErrors comparison(problem.folds, problem.trees, candidates, one_output, 1, uncounted);
  EXPECT_EQ(comparison.leaf_counts(), (std::vector<Eigen::Index>{2, 3, 5, 8, 12}));
  // 8 keeps what none keeps, 1.5 what 2 keeps. Thresholds lie in the middle of the gap, in logarithms; below the
  // smallest jump that is kept, at a quarter of it.
  const std::vector<double> jumps = {llmt::no_jump, std::sqrt(4.0 * 1.0), std::sqrt(1.0 * 0.25), 0.25 / 4.0};
  ASSERT_EQ(comparison.forms().size(), 3 * jumps.size());
  for (std::size_t form = 0; form < comparison.forms().size(); ++form) {
    EXPECT_EQ(comparison.forms()[form].width, candidates.widths[form % 3]) << form;
    if (form < 3) {
      EXPECT_EQ(comparison.forms()[form].jump, llmt::no_jump);
    } else {
      EXPECT_NEAR(comparison.forms()[form].jump, jumps[form / 3], 1e-12) << form;
    }
  }
  const std::set<llmt::Key> keys = {{.form = 1, .leaves = 0},
                                    {.form = 1, .leaves = 4, .ridge = 1},
                                    {.form = 5, .leaves = 2},
                                    {.form = 11, .leaves = 3, .ridge = 1}};
  comparison.evaluate(keys, 2);
  const std::map<llmt::Key, std::vector<double>> of_two = comparison.errors(2);
  ASSERT_EQ(of_two.size(), keys.size());
  EXPECT_TRUE(comparison.errors(3).empty());
  for (const auto& [key, errors] : of_two) {
    ASSERT_EQ(errors.size(), 2U);
    const std::vector<double> expected = problem.errors_of(comparison.candidate(key));
    for (int fold = 0; fold < 2; ++fold) EXPECT_NEAR(errors[fold], expected[fold], 1e-9) << key.form << " " << fold;
  }
  EXPECT_FALSE(comparison.models(*keys.begin())[0].has_value());
  comparison.evaluate({{.form = 0, .leaves = 1}}, 3, true);
  for (const auto& model : comparison.models({.form = 0, .leaves = 1})) {
    ASSERT_TRUE(model.has_value());
    EXPECT_EQ(model->num_leaves(), 3);
  }
}

// Every candidate of a comparison.
std::set<llmt::Key> all_keys(const llmt::HeldOutErrors& comparison, const llmt::Candidates& candidates) {
  std::set<llmt::Key> keys;
  for (std::size_t form = 0; form < comparison.forms().size(); ++form) {
    for (std::size_t leaves = 0; leaves < comparison.leaf_counts().size(); ++leaves) {
      for (std::size_t ridge = 0; ridge < candidates.ridges.size(); ++ridge) keys.insert({form, leaves, ridge});
    }
  }
  return keys;
}

// (C.3): the rows of a fold, in their order, in 16 parts of equal size.
TEST(HeldOutErrors, AreClearlyWorseByThreeStandardErrorsOfSixteenPartsOfEachFold) {
  constexpr Eigen::Index parts = 16;
  const Eigen::MatrixXd x = oracle::uniform(288, 3, 11);  // 96 in a fold, 6 in a part
  const Problem problem(x, oracle::curved(x, 0.1, 11), 12);
  const llmt::Candidates candidates = {
      .widths = {0.5, 2.0}, .jumps = {llmt::no_jump}, .ridges = {1e-4, 1.0}, .shrinkages = {0.0}};
  llmt::Work uncounted;
  llmt::HeldOutErrors comparison(problem.folds, problem.trees, candidates, one_output, 1, uncounted);
  const std::set<llmt::Key> keys = all_keys(comparison, candidates);
  comparison.evaluate(keys, 3);
  for (const int folds : {1, 2, 3}) {
    std::map<llmt::Key, Eigen::VectorXd> of_parts;
    for (const llmt::Key& key : keys) {
      Eigen::VectorXd errors(folds * parts);
      for (int fold = 0; fold < folds; ++fold) {
        const Eigen::VectorXd of_rows = problem.squared_errors(comparison.candidate(key), fold);
        for (Eigen::Index part = 0; part < parts; ++part)
          errors(fold * parts + part) = of_rows.segment(6 * part, 6).sum();
      }
      of_parts[key] = errors;
    }
    int worse = 0;
    int asked = 0;
    for (const auto& [key, errors] : of_parts) {
      EXPECT_FALSE(comparison.is_clearly_worse(key, key, folds));
      for (const auto& [best, least] : of_parts) {
        const Eigen::ArrayXd difference = errors - least;
        const double count = static_cast<double>(difference.size());
        const double square = (difference - difference.mean()).square().sum() / (count - 1.0) / count;
        const double beyond = difference.mean() - 3.0 * std::sqrt(square);
        if (std::abs(beyond) < 1e-9) continue;
        ++asked;
        worse += beyond > 0.0 ? 1 : 0;
        EXPECT_EQ(comparison.is_clearly_worse(key, best, folds), beyond > 0.0) << folds << " " << beyond;
      }
    }
    EXPECT_GT(worse, 10) << "of " << asked;
    EXPECT_LT(worse, asked / 2);
  }
}

// Each number of leaves has validities of its own.
TEST(HeldOutErrors, OfGaussiansAreThoseOfTheirCandidates) {
  const Eigen::MatrixXd x = oracle::uniform(300, 3, 12);
  const Problem problem(x, oracle::curved(x, 0.1, 12), 12);
  for (const llmt::Estimation estimation : {llmt::Estimation::joint, llmt::Estimation::local}) {
    const llmt::Candidates candidates = {.kind = llmt::ValidityKind::gaussian,
                                         .estimation = estimation,
                                         .widths = {0.3, 0.6},
                                         .jumps = {llmt::no_jump},
                                         .ridges = {1e-4, 1e-2},
                                         .shrinkages = {0.1}};
    llmt::Work uncounted;
    llmt::HeldOutErrors comparison(problem.folds, problem.trees, candidates, one_output, 1, uncounted);
    comparison.evaluate(all_keys(comparison, candidates), 3);
    for (const auto& [key, errors] : comparison.errors(3)) {
      const std::vector<double> expected = problem.errors_of(comparison.candidate(key));
      for (int fold = 0; fold < 3; ++fold) EXPECT_NEAR(errors[fold], expected[fold], 1e-9) << key.leaves << " " << fold;
    }
  }
}

// A tree of 180 leaves with 3 coefficients has a sample of 13500 rows, one of 120 leaves or fewer one of 10000.
TEST(HeldOutErrors, AreOfSamplesOf25RowsForEachUnknown) {
  constexpr Eigen::Index rows = 13200;  // that train, in both folds
  const Eigen::MatrixXd x = oracle::uniform(2 * rows, 2, 13);
  const Problem problem(x, oracle::curved(x, 0.3, 13), 180, 2);
  ASSERT_EQ(problem.folds[0].training.count(), rows);
  const llmt::Candidates candidates = {.estimation = llmt::Estimation::local,
                                       .widths = {0.5},
                                       .jumps = {llmt::no_jump},
                                       .ridges = {},
                                       .shrinkages = {0.0}};
  const llmt::Key largest{.leaves = 11};
  const llmt::Key smaller{.leaves = 9};
  llmt::Work uncounted;
  llmt::HeldOutErrors comparison(problem.folds, problem.trees, candidates, one_output, 1, uncounted);
  ASSERT_EQ(comparison.leaf_counts().size(), 12U);
  ASSERT_EQ(comparison.leaf_counts()[11], 180);
  ASSERT_EQ(comparison.leaf_counts()[9], 80);
  // All rows are fewer than the sample of the largest: it is made from all.
  comparison.evaluate({largest}, 1, true);
  EXPECT_NEAR(comparison.errors(1).at(largest)[0], problem.squared_errors(comparison.candidate(largest), 0).sum(),
              1e-7);
  EXPECT_TRUE(comparison.models(largest)[0].has_value());
  // Of the smaller one a sample is enough, whatever was compared before.
  comparison.evaluate({smaller}, 1, true);
  EXPECT_FALSE(comparison.models(smaller)[0].has_value());
  llmt::HeldOutErrors alone(problem.folds, problem.trees, candidates, one_output, 1, uncounted);
  alone.evaluate({smaller}, 1);
  EXPECT_EQ(comparison.errors(1).at(smaller), alone.errors(1).at(smaller));
  const double of_all_rows = problem.squared_errors(comparison.candidate(smaller), 0).sum();
  EXPECT_GT(std::abs(alone.errors(1).at(smaller)[0] - of_all_rows), 1e-6);
  EXPECT_NEAR(alone.errors(1).at(smaller)[0], of_all_rows, 0.05 * of_all_rows);
}

}  // namespace
