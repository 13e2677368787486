// Which candidates the three steps of docs/algorithms/selection.md compare, by the errors that these have.
#include "selection/screening.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <set>
#include <vector>

#include "llmt/selection/folded_problem.hpp"
#include "oracles/oracles.hpp"

namespace {

using folded_problem::one_output;
using folded_problem::Problem;
using llmt::Key;
using Errors = std::map<Key, double>;

constexpr std::size_t screened_shrinkage = 1;  // of 0, 0.1, 1, 10

llmt::Candidates screened_with(const std::vector<double>& widths, const std::vector<double>& jumps) {
  return {.widths = widths, .jumps = jumps, .ridges = {1e-4, 1e-2, 1.0}, .shrinkages = {0.0, 0.1, 1.0, 10.0}};
}

// The steps on four folds of 500 rows: two have the 1000 rows of screening, three are half of the rest besides.
struct Steps {
  Steps(const Problem& problem, const llmt::Candidates& compared, Eigen::Index coefficients_of_a_leaf)
      : candidates(compared),
        coefficients(coefficients_of_a_leaf),
        comparison(problem.folds, problem.trees, candidates, one_output, 1, uncounted),
        kept(llmt::compare_in_steps(comparison, candidates, coefficients, problem.folds)) {}

  Errors tried(std::size_t folds = 2) const {
    Errors sums;
    for (const auto& [key, errors] : comparison.errors(folds)) {
      for (const double error : errors) sums[key] += error;
    }
    return sums;
  }
  Eigen::Index unknowns(const Key& key) const { return comparison.leaf_counts()[key.leaves] * coefficients; }
  bool has_jumps(const Key& key) const { return comparison.forms()[key.form].jump < llmt::no_jump; }
  double width(const Key& key) const { return comparison.forms()[key.form].width; }

  llmt::Candidates candidates;
  Eigen::Index coefficients;
  llmt::Work uncounted;
  llmt::HeldOutErrors comparison;
  std::set<Key> kept;
};

std::set<Key> keys_of(const Errors& errors) {
  std::set<Key> keys;
  for (const auto& [key, error] : errors) keys.insert(key);
  return keys;
}

template <class Wanted>
Errors only(Errors errors, const Wanted& wanted) {
  std::erase_if(errors, [&](const auto& entry) { return !wanted(entry.first); });
  return errors;
}

// The best first.
std::vector<Key> in_order(const Errors& errors) {
  std::vector<Key> keys;
  for (const auto& [key, error] : errors) keys.push_back(key);
  std::ranges::stable_sort(keys, {}, [&](const Key& key) { return errors.at(key); });
  return keys;
}

std::vector<std::size_t> best_forms(const Errors& errors, std::size_t count) {
  std::vector<std::size_t> forms;
  for (const Key& key : in_order(errors)) {
    if (forms.size() < count && std::ranges::find(forms, key.form) == forms.end()) forms.push_back(key.form);
  }
  return forms;
}

// A smooth function, almost without noise: every larger tree is better, and no form is at its end.
Problem smooth_problem() {
  const Eigen::MatrixXd x = oracle::uniform(2000, 3, 21);
  return {x, oracle::curved(x, 0.01, 21), 12, 4};
}

const std::vector<double> eight_widths = {0.25, 0.4, 0.6, 0.8, 1.0, 1.4, 2.0, 3.0};

// With 50 coefficients 2, 3 and 5 leaves have up to 300 unknowns, and 8 and 12 up to 900.
TEST(Screening, TriesAllRidgesWithFewUnknownsAndTheBetterHalfOfTheFormsWithMore) {
  const Problem problem = smooth_problem();
  const Steps steps(problem, screened_with(eight_widths, {llmt::no_jump}), 50);
  ASSERT_EQ(steps.comparison.leaf_counts(), (std::vector<Eigen::Index>{2, 3, 5, 8, 12}));
  const Errors tried = steps.tried();
  Errors first;
  for (std::size_t form = 0; form < eight_widths.size(); ++form) {
    for (std::size_t leaves = 0; leaves < 3; ++leaves) {
      for (std::size_t ridge = 0; ridge < 3; ++ridge) {
        const Key key{form, leaves, ridge, screened_shrinkage};
        ASSERT_TRUE(tried.contains(key)) << form << " " << leaves << " " << ridge;
        first[key] = tried.at(key);
      }
    }
  }
  const std::vector<std::size_t> half = best_forms(first, 4);
  std::set<std::size_t> of_second_round;
  std::set<std::size_t> refined;
  for (const auto& [key, error] : tried) {
    ASSERT_LT(key.ridge, 3U);
    if (key.leaves >= 3) of_second_round.insert(key.form);
    if (key.shrinkage != screened_shrinkage) refined.insert(key.form);
  }
  EXPECT_EQ(of_second_round, std::set<std::size_t>(half.begin(), half.end()));
  EXPECT_EQ(refined.size(), 2U);
}

// At the best number of leaves of a finalist all pairs of a ridge and a shrinkage; the best three of them at the
// neighbouring numbers. With up to 300 unknowns all pairs there too.
TEST(Screening, RefinesTheRegularisationOfTheBestTwoWidths) {
  const Problem problem = smooth_problem();
  for (const Eigen::Index coefficients : {20, 50}) {
    const Steps steps(problem, screened_with({0.5, 1.0, 2.0}, {llmt::no_jump}), coefficients);
    const std::size_t end_of_first = coefficients == 20 ? 5 : 3;
    const Errors tried = steps.tried();
    std::set<std::size_t> refined;
    for (const auto& [key, error] : tried) {
      if (key.shrinkage != screened_shrinkage) refined.insert(key.form);
    }
    ASSERT_EQ(refined.size(), 2U);
    for (const std::size_t form : refined) {
      const Errors of_form = only(tried, [&](const Key& key) { return key.form == form; });
      const Errors first = only(
          of_form, [&](const Key& key) { return key.leaves < end_of_first && key.shrinkage == screened_shrinkage; });
      const std::size_t ridge = in_order(first).front().ridge;
      const Errors screened = only(of_form, [&](const Key& key) {
        return key.shrinkage == screened_shrinkage && (key.leaves < end_of_first || key.ridge == ridge);
      });
      const Key best = in_order(screened).front();
      const std::size_t low = best.leaves - 1;
      const std::size_t high = std::min<std::size_t>(best.leaves + 1, 4);
      std::set<Key> expected = keys_of(screened);
      for (std::size_t leaves = low; leaves <= high; ++leaves) {
        if (coefficients > 20 && leaves != best.leaves) continue;
        for (std::size_t r = 0; r < 3; ++r) {
          for (std::size_t s = 0; s < 4; ++s) expected.insert({form, leaves, r, s});
        }
      }
      std::vector<Key> few = in_order(only(of_form, [&](const Key& key) { return expected.contains(key); }));
      few.resize(3);
      for (const Key& key : few) {
        if (key.leaves != best.leaves) continue;
        for (std::size_t leaves = low; leaves <= high; ++leaves) {
          expected.insert({form, leaves, key.ridge, key.shrinkage});
        }
      }
      EXPECT_EQ(keys_of(of_form), expected) << coefficients << " " << form;
    }
  }
}

// Those that go on to all folds: of the best two widths the best three candidates, and the best of each number of
// leaves near the best. With more than 900 unknowns those that are clearly worse are left out.
TEST(Screening, KeepsTheBestCandidatesForAllFolds) {
  const Problem problem = smooth_problem();
  std::size_t dropped = 0;
  for (const Eigen::Index coefficients : {20, 50, 200}) {
    const Steps steps(problem, screened_with({0.5, 1.0, 2.0}, {llmt::no_jump}), coefficients);
    const Errors tried = steps.tried();
    const auto is_left = [&](const Key& key, const Key& best, std::size_t folds) {
      return steps.unknowns(key) <= 900 || !steps.comparison.is_clearly_worse(key, best, folds);
    };
    std::set<Key> expected;
    const std::vector<std::size_t> forms = best_forms(tried, 2);
    const Key best = in_order(tried).front();
    for (const std::size_t form : forms) {
      const std::vector<Key> order = in_order(only(tried, [&](const Key& key) { return key.form == form; }));
      if (!is_left(order.front(), best, 2)) continue;
      const int reach = steps.unknowns(order.front()) <= 300 ? 2 : 1;
      std::set<std::size_t> counts;
      for (std::size_t k = 0; k < order.size(); ++k) {
        const int steps_off = std::abs(static_cast<int>(order[k].leaves) - static_cast<int>(order.front().leaves));
        const bool is_best_of_count = counts.insert(order[k].leaves).second;
        if (k < 3 || (is_best_of_count && steps_off <= reach)) expected.insert(order[k]);
      }
    }
    dropped += std::erase_if(expected, [&](const Key& key) { return !is_left(key, best, 2); });
    const Errors on_half = steps.tried(3);
    EXPECT_EQ(keys_of(on_half), expected) << coefficients;
    const Key best_on_half = in_order(on_half).front();
    dropped += std::erase_if(expected, [&](const Key& key) { return !is_left(key, best_on_half, 3); });
    EXPECT_EQ(steps.kept, expected) << coefficients;
    EXPECT_EQ(keys_of(steps.tried(4)), expected) << coefficients;
    EXPECT_GE(expected.size(), coefficients == 200 ? 1U : 4U);
  }
  EXPECT_GT(dropped, 0U);
}

// Steps of three heights: a jump threshold is best, and is tried with all widths, the others with the best two.
TEST(Screening, TriesTheBestJumpThresholdWithAllWidths) {
  const Eigen::MatrixXd x = oracle::uniform(2000, 3, 22);
  const auto step = [&](int input, double at) { return (x.col(input).array() > at).cast<double>().matrix(); };
  const Eigen::MatrixXd y =
      3.0 * step(0, 0.1) + 1.0 * step(1, -0.3) + 0.3 * step(2, 0.2) + 0.3 * oracle::curved(x, 0.2, 22);
  const Problem problem(x, y, 12, 4);
  const Steps steps(problem, screened_with({0.25, 0.5, 1.0, 2.0}, {llmt::no_jump, 20.0, 8.0, 3.0, 1.0}), 25);
  ASSERT_GE(steps.comparison.forms().size(), 12U);
  const Errors tried = steps.tried();
  const Errors screened = only(tried, [](const Key& key) { return key.shrinkage == screened_shrinkage; });
  const Key best = in_order(screened).front();
  ASSERT_TRUE(steps.has_jumps(best));
  const std::vector<std::size_t> smooth =
      best_forms(only(screened, [&](const Key& key) { return !steps.has_jumps(key); }), 2);
  for (std::size_t form = 0; form < steps.comparison.forms().size(); ++form) {
    const bool is_of_best_width =
        std::ranges::any_of(smooth, [&](std::size_t other) { return steps.width({other}) == steps.width({form}); });
    const bool is_of_best_jump = steps.comparison.forms()[form].jump == steps.comparison.forms()[best.form].jump;
    const bool has_all_ridges = !steps.has_jumps({form}) || is_of_best_width;
    const Errors of_two_leaves = only(screened, [&](const Key& key) { return key.form == form && key.leaves == 0; });
    EXPECT_EQ(of_two_leaves.size(), has_all_ridges ? 3U : is_of_best_jump ? 1U : 0U) << form;
  }
  // Where a candidate with jumps stays, so does the best of its width without.
  for (const Key& key : steps.kept) {
    EXPECT_TRUE(std::ranges::any_of(steps.kept, [&](const Key& other) {
      return !steps.has_jumps(other) && steps.width(other) == steps.width(key);
    }));
  }
}

}  // namespace
