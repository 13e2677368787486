// The kernels of joint estimation against Eigen's own, at sizes that are no multiple of any block of theirs.
#include "numerics/dense.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <vector>

#include "oracles/oracles.hpp"

namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

RowMajor positive_definite(Eigen::Index size, std::uint64_t seed) {
  const Eigen::MatrixXd a = oracle::uniform(size + 5, size, seed);
  return a.transpose() * a + 0.1 * Eigen::MatrixXd::Identity(size, size);
}

TEST(Dense, ProductIsThatOfEigen) {
  // Every element is a sum of `depth` products of numbers below 1, which rounds by at most depth^2 units of 1e-16.
  for (const Eigen::Index rows : {1, 3, 7, 63, 65, 130}) {
    for (const Eigen::Index columns : {1, 5, 8, 9, 127}) {
      for (const Eigen::Index depth : {1, 2, 33, 255, 257, 600}) {
        const RowMajor a = oracle::uniform(depth, rows, 1);
        const RowMajor b = oracle::uniform(depth, columns, 2);
        for (const double sign : {1.0, -1.0}) {
          RowMajor c = oracle::uniform(rows, columns, 3);
          const RowMajor expected = c + sign * a.transpose() * b;
          llmt::add_transposed_product(rows, columns, depth, sign, a.data(), rows, b.data(), columns, c.data(),
                                       columns);
          EXPECT_LT((c - expected).cwiseAbs().maxCoeff(), 1e-15 * static_cast<double>(depth))
              << rows << " x " << columns << ", depth " << depth;
        }
      }
    }
  }
}

TEST(Dense, ProductOfPartsOfMatricesLeavesTheRestAlone) {
  const RowMajor a = oracle::uniform(40, 50, 4);
  const RowMajor b = oracle::uniform(40, 60, 5);
  RowMajor c = oracle::uniform(70, 80, 6);
  RowMajor expected = c;
  expected.block(3, 11, 13, 21) += a.block(5, 7, 31, 13).transpose() * b.block(5, 9, 31, 21);
  llmt::add_transposed_product(13, 21, 31, 1.0, &a(5, 7), a.cols(), &b(5, 9), b.cols(), &c(3, 11), c.cols());
  EXPECT_LT((c - expected).cwiseAbs().maxCoeff(), 1e-14);
  c.block(3, 11, 13, 21) = expected.block(3, 11, 13, 21);
  EXPECT_EQ(c, expected);
}

TEST(Dense, FactorAndSolutionAreThoseOfEigen) {
  std::vector<Eigen::Index> sizes;
  for (Eigen::Index size = 1; size <= 130; ++size) {
    sizes.push_back(size);
  }
  sizes.insert(sizes.end(), {255, 256, 257, 300, 513});  // around the panels
  for (const Eigen::Index size : sizes) {
    SCOPED_TRACE(size);
    const RowMajor matrix = positive_definite(size, static_cast<std::uint64_t>(size));
    RowMajor factor = matrix;
    factor.triangularView<Eigen::StrictlyLower>().setConstant(std::nan(""));  // it must not be read
    ASSERT_TRUE(llmt::factor_cholesky(factor));
    const Eigen::MatrixXd expected = Eigen::MatrixXd(matrix).llt().matrixU();
    const Eigen::MatrixXd found = factor.triangularView<Eigen::Upper>();
    EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-12 * expected.cwiseAbs().maxCoeff());
    const Eigen::MatrixXd right = oracle::uniform(size, 3, 7);
    Eigen::MatrixXd solution = right;
    llmt::solve_cholesky(factor, solution);
    EXPECT_LT((matrix * solution - right).cwiseAbs().maxCoeff(), 1e-11);
  }
}

TEST(Dense, MatrixThatIsNotPositiveDefiniteIsRefused) {
  for (const Eigen::Index size : {1, 2, 31, 33, 65, 130, 300}) {
    SCOPED_TRACE(size);
    for (const Eigen::Index at : {Eigen::Index{0}, size / 2, size - 1}) {
      RowMajor negative = positive_definite(size, 8);
      negative(at, at) = -1.0;
      EXPECT_FALSE(llmt::factor_cholesky(negative));
      RowMajor not_a_number = positive_definite(size, 9);
      not_a_number(at, at) = std::nan("");
      EXPECT_FALSE(llmt::factor_cholesky(not_a_number));
      RowMajor infinite = positive_definite(size, 10);
      infinite(at, at) = std::numeric_limits<double>::infinity();
      EXPECT_FALSE(llmt::factor_cholesky(infinite));
    }
    RowMajor zero = RowMajor::Zero(size, size);
    EXPECT_FALSE(llmt::factor_cholesky(zero));
  }
  RowMajor indefinite(2, 2);
  indefinite << 1.0, 2.0, 2.0, 1.0;
  EXPECT_FALSE(llmt::factor_cholesky(indefinite));
}

// Eigen cuts its products, and so rounds their sums, by the size of the first cache: not by that of this machine.
TEST(Dense, EigenCutsProductsAlikeOnEveryMachine) { EXPECT_EQ(Eigen::l1CacheSize(), 32 * 1024); }

}  // namespace
