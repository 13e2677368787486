// Least squares under inequalities against brute force over all sets of active ones.
#include "numerics/bounded_least_squares.hpp"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <limits>
#include <vector>

#include "llmt/random.hpp"
#include "oracles/oracles.hpp"

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd normal(Eigen::Index rows, Eigen::Index columns, llmt::Random& random) {
  MatrixXd values(rows, columns);
  for (double& value : values.reshaped()) {
    value = random.normal();
  }
  return values;
}

// The shortest feasible of the shortest points on every set of active inequalities.
VectorXd shortest(const MatrixXd& normals, const VectorXd& bounds) {
  VectorXd best;
  for (int set = 0; set < 1 << bounds.size(); ++set) {
    std::vector<Eigen::Index> active;
    for (Eigen::Index c = 0; c < bounds.size(); ++c) {
      if ((set >> c & 1) != 0) {
        active.push_back(c);
      }
    }
    VectorXd point = VectorXd::Zero(normals.rows());
    if (!active.empty()) {
      const MatrixXd part = normals(Eigen::all, active);
      point = part.transpose().completeOrthogonalDecomposition().solve(VectorXd(bounds(active)));
    }
    const bool feasible = ((normals.transpose() * point - bounds).array() >= -1e-9).all();
    if (feasible && (best.size() == 0 || point.norm() < best.norm())) {
      best = point;
    }
  }
  return best;
}

TEST(LeastDistance, EqualsBruteForceOverActiveSets) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    llmt::Random random(seed);
    const Eigen::Index size = 3 + seed % 4;
    const Eigen::Index count = 1 + seed % 8;
    MatrixXd normals = normal(size, count, random);
    if (count > 2) {
      normals.col(1) = 2.0 * normals.col(0);  // one inequality twice
    }
    const VectorXd inside = normal(size, 1, random);  // so that there is a solution
    const VectorXd bounds = normals.transpose() * inside - normal(count, 1, random).cwiseAbs();
    llmt::LeastDistance problem(size);
    problem.add(normals.leftCols(1), bounds.head(1));
    problem.solve();
    if (count > 1) {
      problem.add(normals.rightCols(count - 1), bounds.tail(count - 1));
    }
    const VectorXd expected = shortest(normals, bounds);
    EXPECT_LE((problem.solve() - expected).norm(), 1e-8 * (1.0 + expected.norm())) << seed;
  }
}

TEST(SignedLeastSquares, EqualsTheBestOfAllSetsOfZeros) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    llmt::Random random(seed);
    const MatrixXd x = normal(20, 4, random);
    const VectorXd y = normal(20, 1, random);
    const std::vector<int> signs = {0, 1, -1, seed % 2 == 0 ? 1 : 0};
    VectorXd best = VectorXd::Zero(4);
    double least = std::numeric_limits<double>::infinity();
    for (int set = 0; set < 16; ++set) {
      std::vector<Eigen::Index> kept;
      for (Eigen::Index k = 0; k < 4; ++k) {
        if ((set >> k & 1) != 0) {
          kept.push_back(k);
        }
      }
      VectorXd model = VectorXd::Zero(4);
      if (!kept.empty()) {
        model(kept) = VectorXd(oracle::least_squares(x(Eigen::all, kept), y));
      }
      bool feasible = true;
      for (std::size_t k = 0; k < 4; ++k) {
        feasible = feasible && signs[k] * model(k) >= 0.0;
      }
      if (feasible && (y - x * model).squaredNorm() < least) {
        least = (y - x * model).squaredNorm();
        best = model;
      }
    }
    const Eigen::LLT<MatrixXd> factor(x.transpose() * x);
    const VectorXd found = llmt::nearest_with_signs(factor, factor.solve(x.transpose() * y), signs);
    EXPECT_LE((found - best).norm(), 1e-9) << seed;
    for (Eigen::Index k = 0; k < 4; ++k) {
      EXPECT_EQ(best(k) == 0.0, found(k) == 0.0) << seed;
    }
  }
}

}  // namespace
