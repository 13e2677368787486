#include "numerics/wide_ridge.hpp"

#include <gtest/gtest.h>

#include <Eigen/QR>

#include "llmt/random.hpp"

namespace llmt {
namespace {

struct Problem {
  Eigen::MatrixXd rows;  // [1, x] times the root of the weights
  Eigen::MatrixXd gram;
  Eigen::VectorXd diagonal;
  Eigen::MatrixXd right;
};

Problem problem_of(Eigen::Index rows, Eigen::Index coefficients, double shrinkage, std::uint64_t seed) {
  Random random(seed);
  Problem made{Eigen::MatrixXd(rows, coefficients), {}, {}, {}};
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double root = random.uniform(0.5, 2.0);
    made.rows(i, 0) = root;
    for (Eigen::Index k = 1; k < coefficients; ++k) made.rows(i, k) = root * (0.1 * random.normal() + 3.0);
  }
  Eigen::MatrixXd outputs(rows, 2);
  for (double& value : outputs.reshaped()) value = random.normal();
  made.gram = made.rows.transpose() * made.rows;
  made.diagonal = Eigen::VectorXd::Constant(coefficients, shrinkage);
  made.diagonal(0) = 0.0;
  made.right = made.rows.transpose() * outputs;
  return made;
}

// Least squares of the rows, and of one more row sqrt(h) e_k for each coefficient: no Gram matrix, so that small ridges
// are told, too.
Eigen::MatrixXd by_rows(const Problem& of, const Eigen::MatrixXd& outputs) {
  const Eigen::Index n = of.rows.rows();
  const Eigen::Index k = of.rows.cols();
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(n + k, k);
  matrix.topRows(n) = of.rows;
  matrix.bottomRows(k).diagonal() = of.diagonal.cwiseSqrt();
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(n + k, outputs.cols());
  right.topRows(n) = outputs;
  return matrix.colPivHouseholderQr().solve(right);
}

TEST(WideRidge, IsAsNearToLeastSquaresOfTheRowsAsAFactorisationOfTheWholeMatrix) {
  for (const double shrinkage : {1e-7, 1e-3, 1.0, 100.0}) {
    for (const Eigen::Index coefficients : {3, 30, 90}) {
      const Problem of = problem_of(12, coefficients, shrinkage, 5);
      const Eigen::MatrixXd expected = by_rows(of, of.rows.transpose().colPivHouseholderQr().solve(of.right));
      Eigen::MatrixXd whole = of.gram;
      whole.diagonal() += of.diagonal;
      const double of_whole = (whole.llt().solve(of.right) - expected).norm();
      const double of_wide = (wide_ridge(of.gram, of.diagonal, of.right, 12) - expected).norm();
      EXPECT_LE(of_wide, 3.0 * of_whole + 1e-11 * expected.norm()) << shrinkage << ", " << coefficients;
    }
  }
}

TEST(WideRidge, EqualColumnsShareTheirSlope) {
  Problem of = problem_of(6, 40, 0.1, 8);
  of.rows.col(7) = of.rows.col(3);
  of.gram = of.rows.transpose() * of.rows;
  of.right = of.rows.transpose() * of.rows.col(3);
  const Eigen::MatrixXd found = wide_ridge(of.gram, of.diagonal, of.right, 6);
  EXPECT_NEAR(found(7, 0), found(3, 0), 1e-12);
  EXPECT_LE((of.gram * found + of.diagonal.asDiagonal() * found - of.right).norm(), 1e-9 * of.right.norm());
}

TEST(WideRidge, ColumnsWithoutSpreadHaveNoSlope) {
  Problem of = problem_of(6, 20, 0.1, 9);
  of.rows.rightCols(19).setZero();
  of.gram = of.rows.transpose() * of.rows;
  of.right = of.rows.transpose() * of.rows.col(0);
  const Eigen::MatrixXd found = wide_ridge(of.gram, of.diagonal, of.right, 6);
  EXPECT_NEAR(found(0, 0), 1.0, 1e-12);
  EXPECT_EQ(found.bottomRows(19).norm(), 0.0);
  EXPECT_EQ(wide_ridge(0.0 * of.gram, of.diagonal, 0.0 * of.right, 6).norm(), 0.0);  // no rows
}

}  // namespace
}  // namespace llmt
