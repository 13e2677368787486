// What the local and the joint estimate of the local models are, on random trees.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "llmt/random.hpp"
#include "oracles/random_trees.hpp"

namespace {

using namespace random_trees;

TEST(Blend, JointEstimateWithoutOverlapIsTheCrispTree) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Data d = data(seed);
    const Kind narrow{llmt::ValidityChoice::blend, 1e-9};
    const llmt::Model crisp = llmt::fit(d.x, d.y.col(0), only(kinds[0], llmt::Estimation::as_grown, 10)).model;
    const llmt::Model blend = llmt::fit(d.x, d.y.col(0), only(narrow, llmt::Estimation::joint, 10)).model;
    ASSERT_EQ(blend.partitions()[0].num_leaves(), 10);
    ASSERT_EQ(blend.partitions()[0].validity.kind, llmt::ValidityKind::blend);
    for (const double reach : {1.0, 3.0}) {
      const Eigen::MatrixXd query = reach * oracle::uniform(300, 3, seed + 100);
      EXPECT_LT((blend.predict(query) - crisp.predict(query)).cwiseAbs().maxCoeff(), 1e-7);
    }
  }
}

TEST(Blend, LocalEstimateIsWeightedLeastSquaresOfEachLeaf) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    for (const std::size_t k : {1, 3, 4}) {
      const Data d = data(seed);
      const llmt::Model model = llmt::fit(d.x, d.y.col(0), only(kinds[k], llmt::Estimation::local, 6)).model;
      const Eigen::MatrixXd validities = model.validities(d.x, 0);
      const std::vector<llmt::Leaf> leaves = model.leaves(0);
      Eigen::MatrixXd a(d.x.rows(), 4);
      a << Eigen::VectorXd::Ones(d.x.rows()), d.x;
      for (Eigen::Index leaf = 0; leaf < validities.cols(); ++leaf) {
        const Eigen::VectorXd roots = validities.col(leaf).cwiseSqrt();
        const Eigen::VectorXd expected = oracle::least_squares(roots.asDiagonal() * a, roots.asDiagonal() * d.y.col(0));
        const llmt::Leaf& found = leaves[leaf];
        // A millionth of a row holds the slopes at the parent's.
        EXPECT_NEAR(found.intercept(0), expected(0), 1e-5);
        EXPECT_LT((found.slope.row(0).transpose() - expected.tail(3)).cwiseAbs().maxCoeff(), 1e-5);
      }
    }
  }
}

TEST(Blend, JointEstimateIsLeastSquaresOnAllLeavesAtOnce) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    for (const std::size_t k : {1, 2, 3, 4}) {
      for (const double ridge : {0.0, 1e-3, 0.1}) {
        const Eigen::MatrixXd x = oracle::firm(oracle::uniform(300, 3, seed));
        const Eigen::VectorXd y = oracle::curved(x, 0.1, seed).col(0);
        llmt::Random random(seed);
        Eigen::VectorXd weights(300);
        for (double& weight : weights) weight = random.uniform(0.5, 2.0);
        const llmt::Model model = llmt::fit({.inputs = x, .outputs = y, .weights = weights},
                                            only(kinds[k], llmt::Estimation::joint, 5, ridge))
                                      .model;
        const Eigen::MatrixXd validities = model.validities(x, 0);
        Eigen::MatrixXd a(300, 4);
        a << Eigen::VectorXd::Ones(300), x;
        // Rows of the data, then for every leaf those that draw its model to the locally weighted one.
        const Eigen::Index leaves = validities.cols();
        Eigen::MatrixXd stacked = Eigen::MatrixXd::Zero(300 * (leaves + 1), 4 * leaves);
        Eigen::VectorXd target = Eigen::VectorXd::Zero(stacked.rows());
        const Eigen::VectorXd roots = weights.cwiseSqrt();
        target.head(300) = roots.asDiagonal() * y;
        for (Eigen::Index leaf = 0; leaf < leaves; ++leaf) {
          stacked.block(0, 4 * leaf, 300, 4) = roots.cwiseProduct(validities.col(leaf)).asDiagonal() * a;
          const Eigen::VectorXd local_roots = weights.cwiseProduct(validities.col(leaf)).cwiseSqrt();
          const Eigen::VectorXd local =
              oracle::least_squares(local_roots.asDiagonal() * a, local_roots.asDiagonal() * y);
          const Eigen::MatrixXd anchor = std::sqrt(ridge) * (local_roots.asDiagonal() * a);
          stacked.block(300 * (leaf + 1), 4 * leaf, 300, 4) = anchor;
          target.segment(300 * (leaf + 1), 300) = anchor * local;
        }
        const Eigen::VectorXd coefficients = oracle::least_squares(stacked, target);
        Eigen::VectorXd expected = Eigen::VectorXd::Zero(300);
        for (Eigen::Index leaf = 0; leaf < leaves; ++leaf) {
          expected += validities.col(leaf).cwiseProduct(a * coefficients.segment(4 * leaf, 4));
        }
        EXPECT_LT((model.predict(x).col(0) - expected).cwiseAbs().maxCoeff(), ridge > 0.0 ? 1e-5 : 1e-3)
            << "kind " << k << ", ridge " << ridge;
      }
    }
  }
}

TEST(Blend, OrderOfRowsChangesNothingBeyondRounding) {
  const Data d = data(52, 400);
  const std::vector<Eigen::Index> order = llmt::Random(3).permutation(400);
  const Eigen::MatrixXd query = 2.0 * oracle::uniform(300, 3, 53);
  for (const Kind& kind : kinds) {
    llmt::FitOptions options = only(kind, llmt::Estimation::joint, 15);
    const Eigen::MatrixXd expected = llmt::fit(d.x, d.y, options).model.predict(query);
    const Eigen::MatrixXd found =
        llmt::fit(d.x(order, Eigen::all), d.y(order, Eigen::all), options).model.predict(query);
    EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-8);
  }
}

}  // namespace
