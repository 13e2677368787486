#include "linear_algebra/linear_algebra.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

namespace llmt::robotics {
namespace {

// All expected numbers are worked out by hand.
Eigen::MatrixXd three_by_two() {
  Eigen::MatrixXd matrix(3, 2);
  matrix << 1, 2,  //
      3, 4,        //
      5, 6;
  return matrix;
}

Eigen::MatrixXd two_by_two(double a, double b, double c, double d) {
  Eigen::MatrixXd matrix(2, 2);
  matrix << a, b, c, d;
  return matrix;
}

Eigen::VectorXd vector(std::initializer_list<double> values) {
  return Eigen::VectorXd::Map(values.begin(), static_cast<Eigen::Index>(values.size()));
}

TEST(LinearAlgebra, ChoosesRowsColumnsAndEntriesInTheOrderGiven) {
  EXPECT_EQ(rows_of(three_by_two(), {2, 0}), two_by_two(5, 6, 1, 2));
  EXPECT_EQ(columns_of(three_by_two(), {1}), vector({2, 4, 6}));
  EXPECT_EQ(entries_of(vector({7, 8, 9}), {2, 2, 0}), vector({9, 9, 7}));
}

TEST(LinearAlgebra, PutsColumnsSideBySide) {
  Eigen::MatrixXd expected(3, 3);
  expected << 7, 1, 2, 8, 3, 4, 9, 5, 6;
  EXPECT_EQ(side_by_side(vector({7, 8, 9}), three_by_two()), expected);
}

TEST(LinearAlgebra, Multiplies) {
  const Eigen::MatrixXd a = three_by_two();
  const Eigen::MatrixXd b = two_by_two(1, -1, 0, 2);
  Eigen::MatrixXd expected(3, 2);
  expected << 1, 3, 3, 5, 5, 7;
  EXPECT_EQ(product(a, b), expected);
  EXPECT_EQ(product(a, vector({1, -1})), vector({-1, -1, -1}));
  EXPECT_EQ(transposed_product(a, expected), two_by_two(35, 53, 44, 68));
  EXPECT_EQ(transposed_product(a, vector({1, 0, -1})), vector({-4, -4}));
  Eigen::MatrixXd left = Eigen::MatrixXd::Ones(3, 2);
  subtract_product(a, b, left);
  EXPECT_EQ(left, Eigen::MatrixXd(Eigen::MatrixXd::Ones(3, 2) - expected));
}

TEST(LinearAlgebra, MakesGramMatricesAndQuadraticForms) {
  const Eigen::MatrixXd a = three_by_two();
  EXPECT_EQ(gram(a), two_by_two(35, 44, 44, 56));
  EXPECT_EQ(weighted_gram(a, vector({1, 0, 2})), two_by_two(51, 62, 62, 76));
  EXPECT_EQ(identity_minus_gram(a), two_by_two(-34, -44, -44, -55));
  EXPECT_EQ(quadratic_forms(a, two_by_two(1, 1, 0, 2)), vector({11, 53, 127}));
}

TEST(LinearAlgebra, MeasuresAndScalesRowsAndColumns) {
  Eigen::MatrixXd a = two_by_two(3, 0, 4, 0);
  EXPECT_EQ(column_norms(a), vector({5, 0}));
  EXPECT_EQ(row_norms(a), vector({3, 4}));
  normalize_columns(a);
  EXPECT_EQ(a, two_by_two(0.6, 0, 0.8, 0));
  Eigen::MatrixXd b = two_by_two(1, 2, 3, 4);
  scale_rows(b, vector({2, 10}));
  EXPECT_EQ(b, two_by_two(2, 4, 30, 40));
  scale_columns(b, vector({0.5, 1}));
  EXPECT_EQ(b, two_by_two(1, 4, 15, 40));
}

// The third column lies between the first two, the last is zero.
TEST(LinearAlgebra, FindsTheRangeOfDependentColumns) {
  const double half = std::sqrt(0.5);
  Eigen::MatrixXd columns(3, 4);
  columns << 1, 0, half, 0,  //
      0, 1, half, 0,         //
      0, 0, 0, 0;
  const Eigen::MatrixXd basis = orthonormal_range(columns);
  ASSERT_EQ(basis.cols(), 2);
  EXPECT_TRUE((basis.transpose() * basis).isIdentity(1e-15));
  EXPECT_TRUE(basis.row(2).isZero(1e-15));
  const std::vector<Eigen::Index> chosen = independent_columns(columns);
  ASSERT_EQ(chosen.size(), 2U);
  EXPECT_LT(chosen[0], chosen[1]);
  EXPECT_LT(chosen[1], 3);  // never the column of zeros

  Eigen::VectorXd point = vector({1, 2, 3});
  remove_range(basis, point);
  EXPECT_TRUE(point.isApprox(vector({0, 0, 3}), 1e-15));
  Eigen::MatrixXd points(3, 2);
  points << 1, 4, 2, 5, 3, 6;
  remove_range(basis, points);
  EXPECT_TRUE(points.topRows(2).isZero(1e-14));
  EXPECT_EQ(points.row(2), Eigen::RowVector2d(3, 6));
}

TEST(LinearAlgebra, SolvesSystems) {
  // The line through (0, 1), (1, 1), (2, 4): 1/2 + 3/2 x.
  Eigen::MatrixXd a(3, 2);
  a << 1, 0, 1, 1, 1, 2;
  EXPECT_TRUE(least_squares(a, vector({1, 1, 4})).isApprox(vector({0.5, 1.5}), 1e-14));
  EXPECT_TRUE(solve_symmetric(two_by_two(4, 2, 2, 3), vector({8, 8})).isApprox(vector({1, 2}), 1e-15));
  EXPECT_TRUE(pseudo_inverse(two_by_two(1, 1, 1, 1)).isApprox(two_by_two(0.25, 0.25, 0.25, 0.25), 1e-15));
}

// [4 2; 2 5] = [2 0; 1 2] [2 1; 0 2]
TEST(LinearAlgebra, FactorsPositiveDefiniteMatrices) {
  const Cholesky factor(two_by_two(4, 2, 2, 5));
  ASSERT_TRUE(factor.exists());
  EXPECT_EQ(factor.lower(), two_by_two(2, 0, 1, 2));
  EXPECT_DOUBLE_EQ(factor.log_determinant(), std::log(16.0));
  EXPECT_TRUE(factor.solve(vector({8, 12})).isApprox(vector({1, 2}), 1e-15));
  const Eigen::MatrixXd right = two_by_two(4, 2, 2, 5);
  EXPECT_TRUE(factor.solve(right).isIdentity(1e-15));
  EXPECT_EQ(factor.whitened(two_by_two(2, 1, 4, 6)), two_by_two(1, 2, 0, 2));
  EXPECT_FALSE(Cholesky(two_by_two(1, 2, 2, 1)).exists());
}

TEST(LinearAlgebra, TurnsARangeIntoTheFirstAxes) {
  Eigen::MatrixXd columns(3, 1);
  columns << 0, 3, 4;
  const RangeRotation turn(columns);
  const Eigen::VectorXd along = turn(vector({0, 3, 4}));
  EXPECT_NEAR(std::abs(along(0)), 5.0, 1e-14);
  EXPECT_TRUE(along.tail(2).isZero(1e-14));
  const Eigen::MatrixXd across = turn(Eigen::MatrixXd(Eigen::Vector3d(1, 4, -3)));
  EXPECT_NEAR(across(0, 0), 0.0, 1e-14);
  EXPECT_NEAR(across.norm(), std::sqrt(26.0), 1e-14);
}

}  // namespace
}  // namespace llmt::robotics
