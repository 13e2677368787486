// What validities promise, on random trees.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include "oracles/random_trees.hpp"

namespace {

using namespace random_trees;

TEST(Validities, AreNotNegativeAndSumToOneEverywhere) {
  for (const Kind& kind : kinds) {
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      const Data d = data(seed);
      llmt::FitOptions options = only(kind, llmt::Estimation::joint, 12);
      options.shared_partition = seed % 2 == 0;
      const llmt::Model model = llmt::fit(d.x, d.y, options).model;
      Eigen::MatrixXd query(900, 3);
      query << oracle::uniform(300, 3, seed + 100), 3.0 * oracle::uniform(300, 3, seed + 200),
          1e6 * oracle::uniform(300, 3, seed + 300);
      for (Eigen::Index p = 0; p < std::ssize(model.partitions()); ++p) {
        const Eigen::MatrixXd validities = model.validities(query, p);
        ASSERT_EQ(validities.cols(), model.partitions()[p].num_leaves());
        EXPECT_GE(validities.minCoeff(), 0.0);
        EXPECT_LT((validities.rowwise().sum().array() - 1.0).abs().maxCoeff(), 1e-12);
        EXPECT_TRUE(model.predict(query).allFinite());
      }
    }
  }
}

TEST(Blend, AffineOutputIsReproducedWhateverThePartition) {
  // Rows in the corners of the extent: the output has been seen as far as it goes there.
  for (const Kind& kind : kinds) {
    for (const llmt::Estimation estimation :
         {llmt::Estimation::as_grown, llmt::Estimation::local, llmt::Estimation::joint}) {
      for (std::uint64_t seed = 1; seed <= 3; ++seed) {
        const Data d = data(seed, 300, true);
        llmt::FitOptions options = only(kind, estimation, 10);
        options.shared_partition = true;
        const llmt::Model model = llmt::fit(d.x, d.y, options).model;
        ASSERT_EQ(model.partitions()[0].num_leaves(), 10);
        for (const double reach : {1.0, 5.0, 1e6}) {
          const Eigen::MatrixXd query = reach * oracle::uniform(200, 3, seed + 100);
          const Eigen::VectorXd expected = affine(query);
          EXPECT_LT((model.predict(query).col(1) - expected).cwiseAbs().maxCoeff(),
                    1e-9 * expected.cwiseAbs().maxCoeff())
              << static_cast<int>(kind.validity) << " reach " << reach;
        }
      }
    }
  }
}

TEST(Blend, AffineDataAreReproducedInCornersWithoutRows) {
  const Data d = data(4);
  for (const double reach : {1.0, 5.0, 1e6}) {
    Eigen::MatrixXd query(8, 3);
    for (int corner = 0; corner < 8; ++corner) {
      for (int j = 0; j < 3; ++j) {
        query(corner, j) = (corner >> j) % 2 == 0 ? -reach : reach;
      }
    }
    const Eigen::VectorXd expected = affine(query);
    EXPECT_LT((llmt::fit(d.x, d.y.col(1)).model.predict(query) - expected).cwiseAbs().maxCoeff(),
              1e-9 * expected.cwiseAbs().maxCoeff())
        << reach;
  }
}

TEST(Blend, JacobianIsTheDifferenceQuotient) {
  const double step = 1e-6;
  for (const Kind& kind : kinds) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      const Data d = data(seed);
      llmt::FitOptions options = only(kind, llmt::Estimation::joint, 10);
      options.shared_partition = seed == 2;
      const llmt::Model model = llmt::fit(d.x, d.y, options).model;
      const Eigen::MatrixXd points = 1.4 * oracle::uniform(100, 3, seed + 100);
      for (Eigen::Index i = 0; i < points.rows(); ++i) {
        const Eigen::MatrixXd jacobian = model.jacobian(points.row(i).transpose());
        Eigen::MatrixXd sides(6, 3);
        for (int j = 0; j < 3; ++j) {
          sides.row(2 * j) = points.row(i);
          sides.row(2 * j + 1) = points.row(i);
          sides(2 * j, j) += step;
          sides(2 * j + 1, j) -= step;
        }
        const Eigen::MatrixXi leaves = model.leaf_of(sides);
        if (kind.validity == llmt::ValidityChoice::crisp && (leaves.rowwise() - leaves.row(0)).any()) {
          continue;  // a jump
        }
        const Eigen::MatrixXd values = model.predict(sides);
        for (int j = 0; j < 3; ++j) {
          const Eigen::VectorXd quotient = (values.row(2 * j) - values.row(2 * j + 1)).transpose() / (2.0 * step);
          EXPECT_LT((jacobian.col(j) - quotient).cwiseAbs().maxCoeff(), 1e-5 * (1.0 + quotient.cwiseAbs().maxCoeff()));
        }
      }
    }
  }
}

TEST(Blend, JacobianIsContinuousAcrossThresholdsAndTransitionEnds) {
  for (const Kind& kind : {kinds[1], kinds[3]}) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      const Data d = data(seed);
      const llmt::Model model = llmt::fit(d.x, d.y.col(0), only(kind, llmt::Estimation::joint, 10)).model;
      const Eigen::MatrixXd points = oracle::uniform(20, 3, seed + 100);
      int tried = 0;
      for (const llmt::Node& node : model.partitions()[0].nodes) {
        for (Eigen::Index i = 0; i < (node.is_leaf() ? 0 : points.rows()); ++i) {
          for (const double at : {-1.0, 0.0, 1.0}) {
            Eigen::VectorXd left = points.row(i).transpose();
            left(node.split_input) = node.threshold + (at - 1e-7) * node.half_width;
            Eigen::VectorXd right = left;
            right(node.split_input) = node.threshold + (at + 1e-7) * node.half_width;
            const Eigen::MatrixXd slope = model.jacobian(left);
            EXPECT_LT((model.jacobian(right) - slope).cwiseAbs().maxCoeff(),
                      1e-4 * (1.0 + slope.cwiseAbs().maxCoeff()));
            ++tried;
          }
        }
      }
      EXPECT_GT(tried, 500);
    }
  }
}

// Largest change of the second derivative between neighbouring points of a grid of that step.
double largest_jump_of_curvature(const llmt::Model& model, double step) {
  double largest = 0.0;
  double slope = 0.0;
  double curvature = 0.0;
  const Eigen::Index points = static_cast<Eigen::Index>(1.8 / step);
  for (Eigen::Index i = 0; i < points; ++i) {
    const double here = model.jacobian(Eigen::VectorXd::Constant(1, -0.9 + step * static_cast<double>(i)))(0, 0);
    const double change = (here - slope) / step;
    if (i > 1) {
      largest = std::max(largest, std::abs(change - curvature));
    }
    slope = here;
    curvature = change;
  }
  return largest;
}

TEST(Blend, SecondDerivativeIsContinuousInFilesOfSmoothnessTwoOnly) {
  const Eigen::MatrixXd x = oracle::uniform(400, 1, 41);
  const Eigen::MatrixXd y = (6.0 * x).array().sin();
  for (const int smoothness : {1, 2}) {
    const Kind kind{llmt::ValidityChoice::blend, 1.0};
    const llmt::Model fitted = llmt::fit(x, y, only(kind, llmt::Estimation::joint, 6)).model;
    // Without the clamp to the residual range, whose own second derivative jumps: it was chosen for smoothness 1.
    std::vector<llmt::Partition> partitions = with_smoothness(fitted, smoothness).partitions();
    partitions[0].residual_range.resize(0, 0);
    const llmt::Model free(fitted.inputs(), fitted.outputs(), fitted.regressors(), partitions);
    const llmt::Model model = llmt::from_json(llmt::to_json(free));
    EXPECT_EQ(model.partitions()[0].validity.smoothness, smoothness);
    // The change goes to zero with the step where the second derivative is continuous, and stays where it jumps.
    const double ratio = largest_jump_of_curvature(model, 2e-5) / largest_jump_of_curvature(model, 2e-4);
    if (smoothness == 1) {
      EXPECT_GT(ratio, 0.7);
    } else {
      EXPECT_LT(ratio, 0.2);
    }
  }
}

}  // namespace
