// What sparse local models promise.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "llmt/compare.hpp"
#include "llmt/fit.hpp"
#include "llmt/fit/local_models.hpp"
#include "numerics/forward_selection.hpp"
#include "oracles/oracles.hpp"
#include "oracles/predict_oracle.hpp"
#include "oracles/random_trees.hpp"

namespace {

using namespace local_models;

// Greedy choice by refitting with every regressor at every step, and AICc of every step.
std::vector<Eigen::Index> refit_selection(const Eigen::MatrixXd& x, const Eigen::VectorXd& y) {
  const double rows = static_cast<double>(x.rows());
  const auto aicc = [&](double rss, double coefficients) {
    const double k = coefficients + 1.0;
    return rows * std::log(rss) + 2.0 * k + 2.0 * k * (k + 1.0) / (rows - k - 1.0);
  };
  std::vector<Eigen::Index> chosen;
  std::vector<Eigen::Index> best;
  double smallest = aicc((y.array() - y.mean()).square().sum(), 1.0);
  while (std::ssize(chosen) < x.cols() && chosen.size() < best.size() + 10) {
    double least = std::numeric_limits<double>::infinity();
    Eigen::Index next = -1;
    for (Eigen::Index k = 0; k < x.cols(); ++k) {
      if (std::ranges::find(chosen, k) == chosen.end()) {
        std::vector<Eigen::Index> tried = chosen;
        tried.push_back(k);
        const double rss = static_cast<double>(oracle::rss(x(Eigen::all, tried), y));
        if (rss < least) {
          least = rss;
          next = k;
        }
      }
    }
    chosen.push_back(next);
    if (const double criterion = aicc(least, 1.0 + static_cast<double>(chosen.size())); criterion < smallest) {
      smallest = criterion;
      best = chosen;
    }
  }
  std::ranges::sort(best);
  return best;
}

TEST(ForwardSelection, IsThatOfARefitAtEveryStep) {
  std::size_t kept = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Eigen::MatrixXd x = oracle::uniform(40, 12, seed);
    x.rightCols(6) += 2.0 * x.leftCols(6);  // far from orthogonal
    x.col(3).array() += 100.0;
    llmt::Random random(seed);
    Eigen::VectorXd y = 2.0 * x.col(0) - x.col(7) + 0.3 * x.col(4);
    for (double& value : y) {
      value += 5.0 + 0.5 * random.normal();
    }
    const Eigen::MatrixXd a = with_constant(x);
    const llmt::LocalSums sums{a.transpose() * a, a.transpose() * y, Eigen::VectorXd::Constant(1, y.squaredNorm())};
    std::vector<Eigen::Index> expected = {0};
    for (const Eigen::Index k : refit_selection(x, y)) {
      expected.push_back(k + 1);
    }
    EXPECT_EQ(llmt::select_regressors(sums, 1.0), expected) << "seed " << seed;
    kept += expected.size() - 1;
  }
  EXPECT_GT(kept, 40U);
  EXPECT_LT(kept, 140U);
}

TEST(ForwardSelection, TakesNothingOfNoiseNorOfConstantAndDoubledColumns) {
  Eigen::MatrixXd x = oracle::uniform(500, 4, 1);
  x.col(1) = x.col(0);
  x.col(2).setConstant(1e3);
  const Eigen::VectorXd y = x.col(0);
  const Eigen::MatrixXd a = with_constant(x);
  const llmt::LocalSums sums{a.transpose() * a, a.transpose() * y, Eigen::VectorXd::Constant(1, y.squaredNorm())};
  EXPECT_EQ(llmt::select_regressors(sums, 1.0), (std::vector<Eigen::Index>{0, 1}));
  const Eigen::VectorXd constant = Eigen::VectorXd::Constant(500, 4.0);
  const llmt::LocalSums level{a.transpose() * a, a.transpose() * constant,
                              Eigen::VectorXd::Constant(1, constant.squaredNorm())};
  EXPECT_EQ(llmt::select_regressors(level, 1.0), (std::vector<Eigen::Index>{0}));
}

// Slopes that are not selected are exactly 0; the others are least squares on all leaves at once, drawn to those of
// each.
TEST(Sparse, JointEstimateIsLeastSquaresOfTheSelectedColumns) {
  for (const ValidityChoice validity : validities) {
    const Eigen::MatrixXd x = oracle::uniform(300, 4, 8);
    const Eigen::VectorXd y = oracle::curved(x, 0.1);
    const llmt::FitResult result = llmt::fit(x, y, only(validity, 4, LocalTerms::quadratic, SparseChoice::always));
    EXPECT_TRUE(result.summary.partitions[0].chosen.candidate.sparse);
    const llmt::Model& model = result.model;
    const std::vector<llmt::Leaf> leaves = model.leaves(0);
    const Eigen::MatrixXd validities = model.validities(x, 0);
    const Eigen::MatrixXd columns = with_constant(regressors_of(model, x));
    const double ridge = validity == ValidityChoice::crisp ? 1.0 : 1e-3;
    std::vector<std::vector<Eigen::Index>> used;
    Eigen::Index unknowns = 0;
    for (const llmt::Leaf& leaf : leaves) {
      used.push_back({0});
      for (Eigen::Index k = 0; k < leaf.slope.cols(); ++k) {
        if (leaf.slope(0, k) != 0.0) {
          used.back().push_back(k + 1);
        }
      }
      EXPECT_EQ(leaf.rank, std::ssize(used.back()));
      EXPECT_LT(leaf.rank, 15);
      unknowns += leaf.rank;
    }
    EXPECT_EQ(result.summary.partitions[0].coefficients, unknowns);
    Eigen::MatrixXd stacked = Eigen::MatrixXd::Zero(300 * (std::ssize(leaves) + 1), unknowns);
    Eigen::VectorXd target = Eigen::VectorXd::Zero(stacked.rows());
    target.head(300) = y;
    Eigen::Index at = 0;
    for (std::size_t leaf = 0; leaf < leaves.size(); ++leaf) {
      const Eigen::Index l = leaf;
      const Eigen::Index count = std::ssize(used[leaf]);
      const Eigen::MatrixXd a = columns(Eigen::all, used[leaf]);
      const Eigen::VectorXd roots = validities.col(l).cwiseSqrt();
      const Eigen::VectorXd local = oracle::least_squares(roots.asDiagonal() * a, roots.asDiagonal() * y);
      const Eigen::MatrixXd anchor = std::sqrt(ridge) * (roots.asDiagonal() * a);
      stacked.block(0, at, 300, count) = validities.col(l).asDiagonal() * a;
      stacked.block(300 * (l + 1), at, 300, count) = anchor;
      target.segment(300 * (l + 1), 300) = anchor * local;
      at += count;
    }
    const Eigen::VectorXd expected = oracle::least_squares(stacked, target);
    at = 0;
    for (std::size_t leaf = 0; leaf < leaves.size(); ++leaf) {
      EXPECT_NEAR(leaves[leaf].intercept(0), expected(at), 1e-4);
      for (std::size_t k = 1; k < used[leaf].size(); ++k) {
        EXPECT_NEAR(leaves[leaf].slope(0, used[leaf][k] - 1), expected(at + k), 1e-4);
      }
      at += std::ssize(used[leaf]);
    }
  }
}

TEST(Sparse, LeverageAndParametersAreOfTheSelectedColumns) {
  const Eigen::MatrixXd x = oracle::uniform(200, 6, 9);
  llmt::Random random(9);
  Eigen::VectorXd y = x.col(1) - 2.0 * x.col(4);
  for (double& value : y) {
    value += 0.1 * random.normal();
  }
  const llmt::FitOptions options = only(ValidityChoice::crisp, 1, LocalTerms::linear, SparseChoice::always);
  const llmt::Model model = llmt::fit(x, y, options).model;
  const llmt::Leaf leaf = model.leaves(0)[0];
  std::vector<Eigen::Index> used;
  for (Eigen::Index k = 0; k < 6; ++k) {
    if (leaf.slope(0, k) != 0.0) {
      used.push_back(k);
    }
  }
  EXPECT_LT(used.size(), 6U);
  const Eigen::MatrixXd a = with_constant(x(Eigen::all, used));
  const Eigen::MatrixXd hat = a * (a.transpose() * a).inverse() * a.transpose();
  const std::vector<llmt::Extrapolation> found = model.extrapolation(x);
  for (Eigen::Index i = 0; i < 200; ++i) {
    EXPECT_NEAR(found[i].leverage, hat(i, i), 1e-5);
  }
  const llmt::ComparisonResult compared = llmt::compare(x, y, {{"sparse", options}});
  EXPECT_EQ(compared.methods[0].parameters, 1 + std::ssize(used));
}

TEST(Sparse, IsTakenWhereFewInputsCountAndHeldOutRowsSaySo) {
  const Eigen::MatrixXd x = oracle::uniform(120, 12, 10);
  llmt::Random random(10);
  Eigen::VectorXd y = (x.col(0).array() > 0.0).select(3.0 * x.col(1), -3.0 * x.col(2));
  for (double& value : y) {
    value += 0.3 * random.normal();
  }
  llmt::FitOptions options;
  options.validity = ValidityChoice::crisp;
  const llmt::FitSummary full = llmt::fit(x, y, options).summary;
  options.sparse = SparseChoice::automatic;
  const llmt::FitSummary sparse = llmt::fit(x, y, options).summary;
  EXPECT_TRUE(sparse.partitions[0].chosen.candidate.sparse);
  EXPECT_LT(sparse.partitions[0].chosen.rmse, full.partitions[0].chosen.rmse);
}

}  // namespace
