#include "check/shared_error.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "llmt/random.hpp"
#include "robotics/check/checked_arm.hpp"

namespace llmt::robotics {
namespace {

using checked::arm;
using checked::measured;

std::vector<Eigen::Index> all_rows(const Measurements& measurements) { return measured_rows(measurements); }

// Correlations of all coordinates, written down pair by pair.
Eigen::MatrixXd correlations(const SharedError& shared, const Measurements& measurements) {
  const Eigen::MatrixXd& q = measurements.poses.joints;
  Eigen::MatrixXd all = Eigen::MatrixXd::Identity(3 * q.rows(), 3 * q.rows());
  for (Eigen::Index i = 0; i < q.rows(); ++i) {
    for (Eigen::Index k = 0; k < q.rows(); ++k) {
      if (i == k) continue;
      double square = 0.0;
      for (Eigen::Index j = 0; j < q.cols(); ++j) square += 2.0 - 2.0 * std::cos(q(i, j) - q(k, j));
      for (int axis = 0; axis < 3; ++axis) {
        all(3 * i + axis, 3 * k + axis) = shared.share * std::exp(-std::sqrt(square) / shared.range);
      }
    }
  }
  return all;
}

Eigen::MatrixXd drawn(Eigen::Index rows, Eigen::Index columns, std::uint64_t seed) {
  Random random(seed);
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); });
}

TEST(SharedError, WhitenedColumnsHaveTheProductsOfGeneralisedLeastSquares) {
  const Measurements poses = measured(arm(), 12, 1);
  const PointRows points = point_rows(arm().chain, poses, all_rows(poses));
  const SharedError shared{.share = 0.8, .range = 1.5, .sigma = 1.0};
  const Eigen::MatrixXd columns = drawn(36, 4, 2);
  const Eigen::MatrixXd white = whitened(shared, points, columns);
  const Eigen::MatrixXd expected = columns.transpose() * correlations(shared, poses).inverse() * columns;
  EXPECT_LT((white.transpose() * white - expected).cwiseAbs().maxCoeff(), 1e-10 * expected.cwiseAbs().maxCoeff());
  EXPECT_LT((coloured(shared, points, white) - columns).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(SharedError, StretchesOfALongTableShareNothing) {
  const Measurements poses = measured(arm(), 12, 1);
  const PointRows points = point_rows(arm().chain, poses, all_rows(poses), 5);
  ASSERT_EQ(points.size(), 3U);
  EXPECT_EQ(points[2].places.cols(), 2);
  const SharedError shared{.share = 0.8, .range = 1.5, .sigma = 1.0};
  Eigen::MatrixXd cut = correlations(shared, poses);
  for (Eigen::Index i = 0; i < 36; ++i) {
    for (Eigen::Index k = 0; k < 36; ++k) cut(i, k) *= i / 15 == k / 15 ? 1.0 : 0.0;
  }
  const Eigen::MatrixXd columns = drawn(36, 4, 2);
  const Eigen::MatrixXd white = whitened(shared, points, columns);
  const Eigen::MatrixXd expected = columns.transpose() * cut.inverse() * columns;
  EXPECT_LT((white.transpose() * white - expected).cwiseAbs().maxCoeff(), 1e-10 * expected.cwiseAbs().maxCoeff());
}

// Poses of a small part of the workspace, residuals of noise or with most of them in common.
TEST(SharedError, TheLikeliestIsNearTheTrueOne) {
  Robot small = arm();
  for (Joint& joint : small.chain.joints) joint.limits = std::array{-20.0, 20.0};
  const SharedError truth{.share = 0.9, .range = 0.8, .sigma = 0.2};
  int independent = 0;
  int common = 0;
  for (std::uint64_t draw = 1; draw <= 20; ++draw) {
    const Measurements poses = measured(small, 40, draw);
    const PointRows points = point_rows(small.chain, poses, all_rows(poses));
    const Eigen::MatrixXd jacobian = drawn(120, 10, 100 + draw);
    const Eigen::VectorXd noise = 0.2 * drawn(120, 1, 200 + draw);
    // What a change of a parameter does, of any size, has no part in it.
    const Eigen::VectorXd changed = jacobian * Eigen::VectorXd::Constant(10, 5.0);
    const Eigen::MatrixXd factor = correlations(truth, poses).llt().matrixL();
    const Eigen::VectorXd shared = factor * noise;
    const SharedError of_noise = likeliest_shared_error(points, jacobian, noise + changed, 0.2);
    const SharedError of_shared = likeliest_shared_error(points, jacobian, shared + changed, 0.2);
    independent += of_noise.share * std::exp(-0.5 / of_noise.range) < 0.2 ? 1 : 0;
    common += of_shared.share >= 0.5 && of_shared.range >= 0.4 && of_shared.range <= 1.6 ? 1 : 0;
    EXPECT_EQ(of_shared.sigma, 0.2);
  }
  EXPECT_GE(independent, 17);
  EXPECT_GE(common, 17);
}

// Poses a few degrees apart, whose errors are alike only next to each other.
TEST(SharedError, AShortRangeIsFound) {
  Robot small = arm();
  for (Joint& joint : small.chain.joints) joint.limits = std::array{-3.0, 3.0};
  const SharedError truth{.share = 0.98, .range = 0.1, .sigma = 0.2};
  int near = 0;
  for (std::uint64_t draw = 1; draw <= 10; ++draw) {
    const Measurements poses = measured(small, 40, draw);
    const PointRows points = point_rows(small.chain, poses, all_rows(poses));
    const Eigen::MatrixXd factor = correlations(truth, poses).llt().matrixL();
    const Eigen::VectorXd shared = factor * (0.2 * drawn(120, 1, 300 + draw));
    near += likeliest_shared_error(points, drawn(120, 4, 400 + draw), shared, 0.2).range == truth.range ? 1 : 0;
  }
  EXPECT_GE(near, 6);
}

// The noise has grown: nothing of it is in common.
TEST(SharedError, NoiseThatGrewIsNotInCommon) {
  const Measurements poses = measured(arm(), 40, 3);
  const PointRows points = point_rows(arm().chain, poses, all_rows(poses));
  const Eigen::MatrixXd jacobian = drawn(120, 10, 4);
  const SharedError shared = likeliest_shared_error(points, jacobian, 0.6 * drawn(120, 1, 5), 0.2);
  EXPECT_EQ(shared.share, 0.0);
  EXPECT_NEAR(shared.sigma, 0.6, 0.1);
}

}  // namespace
}  // namespace llmt::robotics
