// The score of a set of candidates, the moves between sets and the deletion of samples, held against refits.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "discovery/search/explore.hpp"
#include "discovery/search/null_gate.hpp"
#include "search_cases.hpp"

namespace {

using namespace search_cases;

double log_choose(double n, double k) { return std::lgamma(n + 1) - std::lgamma(k + 1) - std::lgamma(n - k + 1); }

/// The score as it stands in search()'s documentation, every number from a refit with the baseline.
double brute_force_score(const Case& data, const Set& set) {
  const double n = static_cast<double>(data.evidence.residuals.size() - data.evidence.jacobian.cols());
  const double rss = refitted_errors(design(data, set), data.evidence.residuals).squaredNorm();
  std::map<std::string, double> places;
  std::map<std::string, double> used;
  double k = 0.0;
  double sum = 0.0;
  for (const EffectCandidate& candidate : data.candidates) places[candidate.family] += 1.0;
  for (const std::size_t a : set) {
    k += static_cast<double>(data.candidates[a].signature.cols());
    used[data.candidates[a].family] += 1.0;
    sum += data.candidates[a].prior_cost;
  }
  for (const auto& [family, count] : used) {
    sum += 2.0 * (std::log(static_cast<double>(places.size())) + log_choose(places[family], count));
  }
  return n * std::log(rss / (n - k)) + k * std::log(n) + sum;
}

Set subset_of(unsigned bits, std::size_t count) {
  Set set;
  for (std::size_t a = 0; a < count; ++a) {
    if (bits >> a & 1U) set.push_back(a);
  }
  return set;
}

TEST(SearchScore, EqualsBruteForceRefitWithTheBaseline) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Case data = random_case(seed, 30, 2, 5, 9, 4);
    data.candidates[3].prior_cost = 1.25;
    const Workspace workspace(data.evidence, data.candidates, 1e-3);
    const Scoring scoring(workspace, data.candidates);
    llmt::Random random(seed + 1000);
    for (int trial = 0; trial < 30; ++trial) {
      const Set set = subset_of(static_cast<unsigned>(random.below(1U << 9)), 9);
      const double score = scoring.score(set);
      if (score == impossible) continue;  // more directions than the data bear
      EXPECT_NEAR(score, brute_force_score(data, set), 1e-7);
      for (const Scoring::Move& move : scoring.additions(set, std::vector<bool>(9, true))) {
        const Set grown = with(set, move.candidate);
        if (std::isfinite(move.score)) {
          EXPECT_NEAR(move.score, brute_force_score(data, grown), 1e-7);
        }
      }
    }
  }
}

TEST(SearchScore, ValuesAndStandardErrorsAreThoseOfTheRefit) {
  Case data = random_case(5, 40, 1, 3, 6, 6);
  add_effect(data, 2, 0.7);
  const Set set = {0, 2, 4};
  const Workspace workspace(data.evidence, data.candidates, 1e-3);
  const Scoring scoring(workspace, data.candidates);
  const SetFit fit = scoring.fit(set);
  const Eigen::MatrixXd matrix = design(data, set);
  const Eigen::VectorXd expected = matrix.colPivHouseholderQr().solve(data.evidence.residuals);
  const Eigen::MatrixXd inverse = (matrix.transpose() * matrix).inverse();
  const double variance =
      (data.evidence.residuals - matrix * expected).squaredNorm() / static_cast<double>(matrix.rows() - matrix.cols());
  Eigen::Index place = 3;
  for (const std::size_t a : set) {
    const Eigen::Index k = data.candidates[a].signature.cols();
    EXPECT_LT((scoring.values(fit, set, a) - expected.segment(place, k)).norm(), 1e-9);
    const Eigen::VectorXd errors = (variance * inverse.diagonal().segment(place, k)).cwiseSqrt();
    EXPECT_LT((scoring.standard_errors(fit, set, a) - errors).norm(), 1e-9);
    place += k;
  }
}

TEST(SearchMoves, FindTheBestOfAllSubsets) {
  constexpr int seeds = 200;
  int found = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    Case data = random_case(static_cast<std::uint64_t>(seed), 60, 1, 4, 10, 5);
    llmt::Random random(static_cast<std::uint64_t>(seed) + 5000);
    for (int k = 0; k < seed % 4; ++k) add_effect(data, random.below(10), random.uniform(0.2, 0.8));
    const Workspace workspace(data.evidence, data.candidates, 1e-3);
    const Scoring scoring(workspace, data.candidates);
    double best = impossible;
    for (unsigned bits = 0; bits < 1U << 10; ++bits) best = std::min(best, scoring.score(subset_of(bits, 10)));
    const Explained own = best_set(scoring, std::vector<bool>(10, true), {}, 16);
    EXPECT_GE(own.score, best - 1e-9);
    found += own.score < best + 1e-6 ? 1 : 0;
  }
  EXPECT_GE(found, seeds * 95 / 100);
}

TEST(SearchDeletion, LeaveOneOutErrorsEqualDeletionAndRefit) {
  for (const Eigen::Index components : {1, 3}) {
    Case data = random_case(7, 40, components, 4, 5, 5);
    const Set set = {1, 3};
    const Workspace workspace(data.evidence, data.candidates, 1e-3);
    const Scoring scoring(workspace, data.candidates);
    const Scoring::Deletion deletion = scoring.deletion(scoring.fit(set));
    const Eigen::MatrixXd matrix = design(data, set);
    const double whole = refitted_errors(matrix, data.evidence.residuals).squaredNorm();
    for (Eigen::Index i = 0; i < 40; ++i) {
      std::vector<Eigen::Index> kept;
      for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
        if (row / components != i) kept.push_back(row);
      }
      const Eigen::MatrixXd rest = matrix(kept, Eigen::all);
      const Eigen::VectorXd rhs = data.evidence.residuals(kept);
      const Eigen::VectorXd values = rest.colPivHouseholderQr().solve(rhs);
      const auto own = Eigen::seqN(i * components, components);
      const Eigen::VectorXd expected = data.evidence.residuals(own) - matrix(own, Eigen::all) * values;
      EXPECT_LT((deletion.errors(own) - expected).norm(), 1e-9);
      EXPECT_NEAR(deletion.gains(i), whole - (rhs - rest * values).squaredNorm(), 1e-9);
    }
  }
}

TEST(SearchDeletion, DroppedSamplesCountAsIfTheyHadNotBeenMeasured) {
  Case data = random_case(9, 40, 2, 5, 6, 3);
  const std::vector<std::size_t> dropped = {3, 17, 18, 39};
  Workspace workspace(data.evidence, data.candidates, 1e-3);
  workspace.drop({3});
  workspace.drop({17, 18, 39});
  Case rest = data;
  std::vector<Eigen::Index> kept;
  for (Eigen::Index row = 0; row < 80; ++row) {
    if (std::ranges::find(dropped, static_cast<std::size_t>(row / 2)) == dropped.end()) kept.push_back(row);
  }
  rest.evidence.residuals = data.evidence.residuals(kept).eval();
  rest.evidence.jacobian = data.evidence.jacobian(kept, Eigen::all).eval();
  for (EffectCandidate& candidate : rest.candidates) candidate.signature = candidate.signature(kept, Eigen::all).eval();
  const Workspace expected(rest.evidence, rest.candidates, 1e-3);
  const Scoring scoring(workspace, data.candidates);
  const Scoring other(expected, rest.candidates);
  for (const Set& set : std::vector<Set>{{}, {0}, {1, 2}, {0, 3, 5}}) {
    const SetFit fit = scoring.fit(set);
    const SetFit without_them = other.fit(set);
    EXPECT_NEAR(fit.left, without_them.left, 1e-9);
    EXPECT_EQ(scoring.dof(fit), other.dof(without_them));
    for (const std::size_t a : set) {
      EXPECT_LT((scoring.values(fit, set, a) - other.values(without_them, set, a)).norm(), 1e-9);
    }
    EXPECT_LT((scoring.remaining(fit)(kept) - other.remaining(without_them)).norm(), 1e-9);
  }
}

TEST(SearchDeletion, ASetThatCollapsesWithADroppedSampleEndsTheSearchForOutliers) {
  Case data = random_case(12, 40, 1, 3, 2, 2);
  data.candidates[1].signature = data.candidates[0].signature;
  data.candidates[1].signature(7, 0) += 30.0;
  data.evidence.residuals(7) += 100.0;
  data.evidence.residuals(20) += 100.0;
  const Workspace workspace(data.evidence, data.candidates, 1e-3);
  for (const std::size_t sample : outliers_given(workspace, data.candidates, {0, 1}, 6)) {
    EXPECT_TRUE(sample == 7 || sample == 20);
  }
  for (const std::size_t sample : competing_outliers(workspace, data.candidates, 16, 6)) {
    EXPECT_TRUE(sample == 7 || sample == 20);
  }
}

}  // namespace
