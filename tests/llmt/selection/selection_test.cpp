// What held-out rows decide, beside every candidate made and asked by itself.
#include "selection/selection.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <vector>

#include "llmt/selection/folded_problem.hpp"
#include "oracles/oracles.hpp"
#include "oracles/random_trees.hpp"
#include "selection/held_out_errors.hpp"

namespace {

using folded_problem::fold_count;
using folded_problem::Problem;

llmt::Candidates candidates_with(const std::vector<double>& jumps) {
  return {.widths = {0.5, 1.0, 2.0}, .jumps = jumps, .ridges = {1e-4, 1e-2}, .shrinkages = {0.0}};
}

// The smallest error of a blend: every width, ridge and number of leaves.
double best_blend(const Problem& problem, const llmt::Candidates& candidates, const std::vector<Eigen::Index>& counts) {
  double best = std::numeric_limits<double>::infinity();
  for (const double width : candidates.widths) {
    for (const double ridge : candidates.ridges) {
      for (const Eigen::Index leaves : counts) {
        best = std::min(best, problem.rmse_of({.validity = {llmt::ValidityKind::blend, width},
                                               .estimation = llmt::Estimation::joint,
                                               .ridge = ridge,
                                               .leaves = leaves}));
      }
    }
  }
  return best;
}

// A model of one leaf goes on beyond its rows as a plane, the root of a larger tree not quite.
double tolerance(Eigen::Index leaves) { return leaves == 1 ? 1e-4 : 1e-9; }

TEST(Selection, ErrorsAreThoseOfModelsThatAreMadeAndAskedByThemselves) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const Eigen::MatrixXd x = oracle::uniform(300, 3, seed);
    const Problem problem(x, oracle::curved(x, 0.1, seed), 12);
    const llmt::Candidates candidates = candidates_with({llmt::no_jump});
    const llmt::Selection selection = problem.select(candidates);
    EXPECT_EQ(selection.held_out_rows, 300);
    ASSERT_EQ(selection.crisp_rmse.size(), 12);
    for (Eigen::Index leaves = 1; leaves <= 12; ++leaves) {
      const double rmse = problem.rmse_of({.leaves = leaves});
      EXPECT_NEAR(selection.crisp_rmse(leaves - 1), rmse, tolerance(leaves)) << leaves;
    }
    ASSERT_GE(selection.best_of_kind.size(), 3U);
    for (const llmt::CandidateError& each : selection.best_of_kind) {
      const std::vector<double> errors = problem.errors_of(each.candidate);
      EXPECT_NEAR(each.rmse, problem.rmse_of(each.candidate), tolerance(each.candidate.leaves));
      for (int fold = 0; fold < fold_count; ++fold) {
        EXPECT_NEAR(each.fold_rmse(fold), std::sqrt(errors[fold] / 100.0), tolerance(each.candidate.leaves)) << fold;
      }
    }
    // 12, then two thirds of the one before, down to 2; no candidate is better than the chosen one.
    EXPECT_NEAR(selection.chosen.rmse, best_blend(problem, candidates, {2, 3, 5, 8, 12}), 1e-9) << seed;
    EXPECT_EQ(selection.chosen.candidate.jump, llmt::no_jump);
    ASSERT_EQ(selection.made.size(), 3U);
  }
}

// Of noise about a plane nothing gains beyond chance.
TEST(Selection, KeepsLeastSquaresOfAPlane) {
  const Eigen::MatrixXd x = oracle::uniform(300, 3, 5);
  const Eigen::MatrixXd y = random_trees::affine(x) + 0.3 * oracle::uniform(300, 1, 6);
  const Problem problem(x, y, 12);
  const llmt::Selection selection = problem.select(candidates_with({llmt::no_jump}));
  EXPECT_EQ(selection.chosen.candidate.leaves, 1);
  EXPECT_NEAR(selection.linear.rmse, problem.rmse_of({.leaves = 1}), tolerance(1));
  EXPECT_TRUE(selection.made.empty());
}

TEST(Selection, TakesJumpsWhereTheFunctionJumps) {
  const Eigen::MatrixXd x = oracle::uniform(400, 3, 7);
  const Eigen::MatrixXd y = 3.0 * (x.col(0).array() > 0.1).cast<double>().matrix() +
                            (2.0 * x.col(1).array()).sin().matrix() + 0.05 * oracle::uniform(400, 1, 8);
  const Problem problem(x, y, 12);
  const llmt::Selection selection = problem.select(candidates_with({llmt::no_jump, 1.0}));
  EXPECT_LT(selection.chosen.candidate.jump, llmt::no_jump);
  for (const llmt::CandidateError& each : selection.best_of_kind) {
    EXPECT_NEAR(each.rmse, problem.rmse_of(each.candidate), tolerance(each.candidate.leaves));
    EXPECT_GE(each.rmse, selection.chosen.rmse);
  }
}

// Of a step between planes both a crisp tree and a blend with a jump are right: the tree, which is simpler, stays
// unless the blend gains beyond chance.
TEST(Selection, JumpsAreTakenOnlyForAGainBeyondChance) {
  int taken = 0;
  int left = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const Eigen::MatrixXd x = oracle::uniform(300, 3, 30 + seed);
    const double curvature = seed % 2 == 0 ? 1.0 : 0.0;
    const Eigen::MatrixXd y = 3.0 * (x.col(0).array() > 0.1).cast<double>().matrix() + random_trees::affine(x) +
                              curvature * (3.0 * x.col(1).array()).sin().matrix() +
                              0.3 * oracle::uniform(300, 1, 40 + seed);
    const Problem problem(x, y, 12);
    const llmt::Selection selection = problem.select(candidates_with({llmt::no_jump, 1.0}));
    const llmt::CandidateError* simple = nullptr;  // the best without a jump
    const auto has_jumps = [](const llmt::CandidateError& each) { return each.candidate.jump < llmt::no_jump; };
    for (const llmt::CandidateError& each : selection.best_of_kind) {
      if (!has_jumps(each) && (!simple || each.rmse < simple->rmse)) simple = &each;
    }
    ASSERT_NE(simple, nullptr);
    const bool some_gain = std::ranges::any_of(selection.best_of_kind, [&](const llmt::CandidateError& each) {
      return has_jumps(each) && is_beyond_chance(*simple, each);
    });
    EXPECT_EQ(has_jumps(selection.chosen), some_gain) << seed;
    if (!some_gain) {
      EXPECT_EQ(selection.chosen.candidate, simple->candidate) << seed;
    }
    const bool some_jump = std::ranges::any_of(selection.best_of_kind, has_jumps);
    (some_gain ? taken : left) += some_jump ? 1 : 0;
  }
  EXPECT_GE(taken, 1);
  EXPECT_GE(left, 1);
}

// Least squares, the best crisp tree, and the best blend of each of the two widths that were compared on all folds.
TEST(Selection, ListsTheBestOfEachKindOnce) {
  const Eigen::MatrixXd x = oracle::uniform(300, 3, 50);
  const Problem problem(x, oracle::curved(x, 0.1, 50), 12);
  const llmt::Selection selection = problem.select(candidates_with({llmt::no_jump}));
  ASSERT_EQ(selection.best_of_kind.size(), 4U);
  EXPECT_EQ(selection.best_of_kind[0].candidate, (llmt::Candidate{.leaves = 1}));
  EXPECT_EQ(selection.best_of_kind[1].candidate.validity.kind, llmt::ValidityKind::crisp);
  EXPECT_GT(selection.best_of_kind[1].candidate.leaves, 1);
  std::set<double> widths;
  for (std::size_t k = 2; k < 4; ++k) {
    EXPECT_EQ(selection.best_of_kind[k].candidate.validity.kind, llmt::ValidityKind::blend);
    widths.insert(selection.best_of_kind[k].candidate.validity.width);
  }
  EXPECT_EQ(widths.size(), 2U);
}

// Leaves that have to be in order: each number of leaves has models of its own, and 1, 2, 3, 5, 8 and all are tried.
TEST(Selection, OfTreesWithMonotoneSplitsHasTheErrorsOfSomeNumbersOfLeaves) {
  const Eigen::MatrixXd x = oracle::uniform(300, 3, 51);
  const Problem problem(x, oracle::curved(x, 0.3, 51), 12, fold_count, {1, 0, 0});
  llmt::Candidates candidates = candidates_with({llmt::no_jump});
  candidates.widths = {};
  const Eigen::VectorXd rmse = problem.select(candidates).crisp_rmse;
  ASSERT_EQ(rmse.size(), 12);
  for (Eigen::Index leaves = 1; leaves <= 12; ++leaves) {
    const bool is_tried = std::set<Eigen::Index>{1, 2, 3, 5, 8, 12}.contains(leaves);
    EXPECT_EQ(std::isfinite(rmse(leaves - 1)), is_tried) << leaves;
    if (is_tried) {
      EXPECT_NEAR(rmse(leaves - 1), problem.rmse_of({.leaves = leaves}), 1e-9) << leaves;
    }
  }
}

llmt::CandidateError with_folds(const std::vector<double>& rmse) {
  llmt::CandidateError error;
  error.fold_rmse = Eigen::VectorXd::Map(rmse.data(), std::ssize(rmse));
  error.rmse = error.fold_rmse.mean();
  return error;
}

TEST(Selection, AGainBeyondChanceIsTwoStandardErrors) {
  const llmt::CandidateError simple = with_folds({1.0, 1.0, 1.0});
  // Gains of 0.1, 0.2, 0.3: mean 0.2, standard error 0.1 / sqrt(3) = 0.058.
  EXPECT_TRUE(is_beyond_chance(simple, with_folds({0.9, 0.8, 0.7})));
  // 0.1, -0.1, 0.3: mean 0.1, standard error 0.2 / sqrt(3) = 0.115; 0, 0.1, 0.2: 0.1 and 0.058.
  EXPECT_FALSE(is_beyond_chance(simple, with_folds({0.9, 1.1, 0.7})));
  EXPECT_FALSE(is_beyond_chance(simple, with_folds({1.0, 0.9, 0.8})));
  EXPECT_FALSE(is_beyond_chance(simple, simple));
  EXPECT_TRUE(is_beyond_chance(with_folds({1.0}), with_folds({0.999})));
  EXPECT_FALSE(is_beyond_chance(with_folds({1.0}), with_folds({1.0})));
}

TEST(Selection, ASampleHas25RowsForEachUnknownAndTenThousandAtLeast) {
  EXPECT_EQ(llmt::enough_rows(4, 10), 10000);
  EXPECT_EQ(llmt::enough_rows(40, 10), 10000);
  EXPECT_EQ(llmt::enough_rows(41, 10), 10250);
}

}  // namespace
