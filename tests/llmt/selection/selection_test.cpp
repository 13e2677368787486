// What held-out rows decide, beside every candidate made and asked by itself.
#include "selection/selection.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <vector>

#include "data/dataset.hpp"
#include "estimation/jumps.hpp"
#include "llmt/model.hpp"
#include "oracles/oracles.hpp"
#include "oracles/random_trees.hpp"
#include "selection/held_out_errors.hpp"
#include "selection/screening.hpp"

namespace {

constexpr int fold_count = 3;

// Rows in three folds, and a tree that was grown without each of them.
struct Problem {
  Problem(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& output, Eigen::Index most_leaves)
      : x(inputs), y(output), table{x, y, Eigen::VectorXd::Ones(x.rows()), {0, 0, 0}, {0, 1, 2}, {0, 1, 2}} {
    for (int fold = 0; fold < fold_count; ++fold) {
      std::vector<int> learned;
      for (int i = 0; i < x.rows(); ++i) (i % fold_count == fold ? held[fold] : learned).push_back(i);
      const llmt::TrainingRows training = llmt::training_rows(table, learned);
      folds.push_back({training, llmt::query_rows(table, held[fold], training)});
      const llmt::FitOptions options =
          random_trees::only(random_trees::kinds[0], llmt::Estimation::as_grown, most_leaves);
      const llmt::Model grown = llmt::fit(x(learned, Eigen::all), y(learned, Eigen::all), options).model;
      const llmt::Partition& partition = grown.partitions()[0];
      trees.push_back({partition, llmt::jump_sizes(training, partition, 1)});
    }
  }

  llmt::Selection select(const llmt::Candidates& candidates) const {
    llmt::Work uncounted;
    return llmt::select(folds, trees, candidates, Eigen::VectorXd::Ones(1), 1, uncounted);
  }

  // Sum of the squared errors of a candidate in each fold, whose model is made by itself and predicts row by row.
  std::vector<double> errors_of(const llmt::Candidate& candidate) const {
    std::vector<double> errors;
    for (int fold = 0; fold < fold_count; ++fold) {
      llmt::Work uncounted;
      llmt::Candidate here = candidate;
      here.leaves = std::min(candidate.leaves, trees[fold].partition.num_leaves());
      const llmt::TrainingRows& training = folds[fold].training;
      const llmt::Partition made = llmt::estimate(training, trees[fold], here, 1, uncounted);
      const llmt::Model model{training.columns, training.output_columns, training.regressors, {made}};
      errors.push_back((model.predict(x(held[fold], Eigen::all)) - y(held[fold], Eigen::all)).squaredNorm());
    }
    return errors;
  }

  double rmse_of(const llmt::Candidate& candidate) const {
    double sum = 0.0;
    for (const double error : errors_of(candidate)) sum += error;
    return std::sqrt(sum / static_cast<double>(x.rows()));
  }

  Eigen::MatrixXd x;
  Eigen::MatrixXd y;
  llmt::Table table;
  std::array<std::vector<int>, fold_count> held;
  std::vector<llmt::FoldRows> folds;
  std::vector<llmt::GrownTree> trees;
};

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

TEST(HeldOutErrors, HaveTheFormsLeafCountsAndErrorsOfTheirCandidates) {
  const Eigen::MatrixXd x = oracle::uniform(300, 3, 9);
  Problem problem(x, oracle::curved(x, 0.1, 9), 12);
  // Jumps as if they were: 4 and 1 are apart from 0.25 in all folds.
  for (llmt::GrownTree& tree : problem.trees) {
    tree.jumps.setConstant(0.25);
    tree.jumps(0) = 4.0;
    tree.jumps(2) = 1.0;
  }
  llmt::Candidates candidates = candidates_with({llmt::no_jump, 8.0, 2.0, 1.5, 0.5, 0.1});
  llmt::Work uncounted;
  const Eigen::VectorXd weights = Eigen::VectorXd::Ones(1);
  llmt::HeldOutErrors comparison(problem.folds, problem.trees, candidates, weights, 1, uncounted);
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

}  // namespace
