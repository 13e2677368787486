// What validities, their estimates, weights, missing values and categories promise, on random trees.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "llmt/fit.hpp"
#include "oracles.hpp"

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

struct Kind {
  llmt::ValidityChoice validity;
  int smoothness;
  double width;
};

const std::vector<Kind> kinds = {{llmt::ValidityChoice::crisp, 1, 1.0},
                                 {llmt::ValidityChoice::blend, 1, 0.5},
                                 {llmt::ValidityChoice::blend, 1, 2.0},
                                 {llmt::ValidityChoice::blend, 2, 1.0},
                                 {llmt::ValidityChoice::gaussian, 1, 1.0 / 3.0}};

/// One candidate, no choice.
llmt::FitOptions only(const Kind& kind, llmt::Estimation estimation, std::ptrdiff_t max_leaves, double ridge = 1e-3) {
  llmt::FitOptions options;
  options.growth = {.significance = 1.0, .min_variance_gain = -1.0, .max_leaves = max_leaves};
  options.blend = {.validity = kind.validity,
                   .estimation = estimation,
                   .widths = {kind.width},
                   .ridges = {ridge},
                   .shrinkages = {0.0},
                   .smoothness = kind.smoothness};
  options.selection.folds.count = 0;
  return options;
}

/// A curved output and an affine one, which a shared partition has to serve both.
struct Data {
  Eigen::MatrixXd x;
  Eigen::MatrixXd y;
};

Eigen::VectorXd affine(const Eigen::MatrixXd& x) { return (x * Eigen::Vector3d(1.0, -2.0, 0.5)).array() + 3.0; }

Data data(std::uint64_t seed, std::ptrdiff_t rows = 300, bool corners = false) {
  Eigen::MatrixXd x = oracle::uniform(rows, 3, seed);
  for (int corner = 0; corner < (corners ? 16 : 0); ++corner) {  // each twice
    for (int j = 0; j < 3; ++j) {
      x(corner, j) = (corner >> j) % 2 == 0 ? -1.0 : 1.0;
    }
  }
  Eigen::MatrixXd y(rows, 2);
  y << oracle::curved(x, 0.1, seed), affine(x);
  return {std::move(x), std::move(y)};
}

std::string message_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "no std::invalid_argument";
}

TEST(Validities, AreNotNegativeAndSumToOneEverywhere) {
  for (const Kind& kind : kinds) {
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      const Data d = data(seed);
      llmt::FitOptions options = only(kind, llmt::Estimation::joint, 12);
      options.growth.shared_partition = seed % 2 == 0;
      const llmt::Model model = llmt::fit(d.x, d.y, options).model;
      Eigen::MatrixXd query(900, 3);
      query << oracle::uniform(300, 3, seed + 100), 3.0 * oracle::uniform(300, 3, seed + 200),
          1e6 * oracle::uniform(300, 3, seed + 300);
      for (std::ptrdiff_t p = 0; p < std::ssize(model.partitions()); ++p) {
        const Eigen::MatrixXd validities = model.validities(query, p);
        ASSERT_EQ(validities.cols(), model.partitions()[static_cast<std::size_t>(p)].num_leaves());
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
        options.growth.shared_partition = true;
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

TEST(Blend, JointEstimateWithoutOverlapIsTheCrispTree) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Data d = data(seed);
    const Kind narrow{llmt::ValidityChoice::blend, 1, 1e-9};
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

TEST(Blend, JacobianIsTheDifferenceQuotient) {
  const double step = 1e-6;
  for (const Kind& kind : kinds) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      const Data d = data(seed);
      llmt::FitOptions options = only(kind, llmt::Estimation::joint, 10);
      options.growth.shared_partition = seed == 2;
      const llmt::Model model = llmt::fit(d.x, d.y, options).model;
      const Eigen::MatrixXd points = 1.4 * oracle::uniform(100, 3, seed + 100);
      for (std::ptrdiff_t i = 0; i < points.rows(); ++i) {
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
        for (std::ptrdiff_t i = 0; i < (node.is_leaf() ? 0 : points.rows()); ++i) {
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

/// Largest change of the second derivative between neighbouring points of a grid of that step.
double largest_jump_of_curvature(const llmt::Model& model, double step) {
  double largest = 0.0;
  double slope = 0.0;
  double curvature = 0.0;
  const std::ptrdiff_t points = static_cast<std::ptrdiff_t>(1.8 / step);
  for (std::ptrdiff_t i = 0; i < points; ++i) {
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

TEST(Blend, SecondDerivativeIsContinuousForSmoothnessTwoOnly) {
  const Eigen::MatrixXd x = oracle::uniform(400, 1, 41);
  const Eigen::MatrixXd y = (6.0 * x).array().sin();
  for (const int smoothness : {1, 2}) {
    const Kind kind{llmt::ValidityChoice::blend, smoothness, 1.0};
    const llmt::Model model = llmt::fit(x, y, only(kind, llmt::Estimation::joint, 6)).model;
    // The change goes to zero with the step where the second derivative is continuous, and stays where it jumps.
    const double ratio = largest_jump_of_curvature(model, 2e-5) / largest_jump_of_curvature(model, 2e-4);
    if (smoothness == 1) {
      EXPECT_GT(ratio, 0.7);
    } else {
      EXPECT_LT(ratio, 0.2);
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
      for (std::ptrdiff_t leaf = 0; leaf < validities.cols(); ++leaf) {
        const Eigen::VectorXd roots = validities.col(leaf).cwiseSqrt();
        const Eigen::VectorXd expected = oracle::least_squares(roots.asDiagonal() * a, roots.asDiagonal() * d.y.col(0));
        const llmt::Leaf& found = leaves[static_cast<std::size_t>(leaf)];
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
        llmt::FitOptions options = only(kinds[k], llmt::Estimation::joint, 5, ridge);
        options.weights.resize(300);
        for (double& weight : options.weights) {
          weight = random.uniform(0.5, 2.0);
        }
        const llmt::Model model = llmt::fit(x, y, options).model;
        const Eigen::MatrixXd validities = model.validities(x, 0);
        Eigen::MatrixXd a(300, 4);
        a << Eigen::VectorXd::Ones(300), x;
        // Rows of the data, then for every leaf those that draw its model to the locally weighted one.
        const std::ptrdiff_t leaves = validities.cols();
        Eigen::MatrixXd stacked = Eigen::MatrixXd::Zero(300 * (leaves + 1), 4 * leaves);
        Eigen::VectorXd target = Eigen::VectorXd::Zero(stacked.rows());
        const Eigen::VectorXd roots = options.weights.cwiseSqrt();
        target.head(300) = roots.asDiagonal() * y;
        for (std::ptrdiff_t leaf = 0; leaf < leaves; ++leaf) {
          stacked.block(0, 4 * leaf, 300, 4) = roots.cwiseProduct(validities.col(leaf)).asDiagonal() * a;
          const Eigen::VectorXd local_roots = options.weights.cwiseProduct(validities.col(leaf)).cwiseSqrt();
          const Eigen::VectorXd local =
              oracle::least_squares(local_roots.asDiagonal() * a, local_roots.asDiagonal() * y);
          const Eigen::MatrixXd anchor = std::sqrt(ridge) * (local_roots.asDiagonal() * a);
          stacked.block(300 * (leaf + 1), 4 * leaf, 300, 4) = anchor;
          target.segment(300 * (leaf + 1), 300) = anchor * local;
        }
        const Eigen::VectorXd coefficients = oracle::least_squares(stacked, target);
        Eigen::VectorXd expected = Eigen::VectorXd::Zero(300);
        for (std::ptrdiff_t leaf = 0; leaf < leaves; ++leaf) {
          expected += validities.col(leaf).cwiseProduct(a * coefficients.segment(4 * leaf, 4));
        }
        EXPECT_LT((model.predict(x).col(0) - expected).cwiseAbs().maxCoeff(), ridge > 0.0 ? 1e-5 : 1e-3)
            << "kind " << k << ", ridge " << ridge;
      }
    }
  }
}

TEST(Fit, SameBytesAtAnyNumberOfThreadsWithCategoriesAndMissingValues) {
  llmt::Random random(51);
  Eigen::MatrixXd x = oracle::uniform(400, 3, 51);
  const Eigen::MatrixXd y = oracle::curved(x, 0.1);
  for (std::ptrdiff_t i = 0; i < 400; ++i) {
    x(i, 1) = std::floor(2.0 * x(i, 1) + 2.0);
    if (i % 5 == 0) {
      x(i, static_cast<std::ptrdiff_t>(random.below(3))) = nan;
    }
  }
  for (const llmt::ValidityChoice choice : {llmt::ValidityChoice::automatic, llmt::ValidityChoice::gaussian}) {
    std::vector<std::string> models;
    for (const int threads : {1, 2, 8}) {
      llmt::FitOptions options;
      options.blend.validity = choice;
      options.categorical_inputs = {1};
      options.max_threads = threads;
      models.push_back(llmt::to_json(llmt::fit(x, y, options).model));
    }
    EXPECT_EQ(models[0], models[1]);
    EXPECT_EQ(models[0], models[2]);
  }
}

TEST(Blend, OrderOfRowsChangesNothingBeyondRounding) {
  const Data d = data(52, 400);
  const std::vector<std::ptrdiff_t> order = llmt::Random(3).permutation(400);
  const Eigen::MatrixXd query = 2.0 * oracle::uniform(300, 3, 53);
  for (const Kind& kind : kinds) {
    llmt::FitOptions options = only(kind, llmt::Estimation::joint, 15);
    const Eigen::MatrixXd expected = llmt::fit(d.x, d.y, options).model.predict(query);
    const Eigen::MatrixXd found =
        llmt::fit(d.x(order, Eigen::all), d.y(order, Eigen::all), options).model.predict(query);
    EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-8);
  }
}

TEST(Weights, IntegersAreRepeatedRows) {
  const Eigen::MatrixXd x = oracle::firm(oracle::uniform(200, 3, 54));
  const Eigen::MatrixXd y = oracle::curved(x, 0.1);
  const Eigen::MatrixXd query = oracle::uniform(300, 3, 55);
  llmt::Random random(56);
  Eigen::VectorXd weights(200);
  std::vector<std::ptrdiff_t> repeated;
  for (std::ptrdiff_t i = 0; i < 200; ++i) {
    weights(i) = static_cast<double>(1 + random.below(3));
    repeated.insert(repeated.end(), static_cast<std::size_t>(weights(i)), i);
  }
  for (const Kind& kind : {kinds[0], kinds[1], kinds[4]}) {
    llmt::FitOptions options = only(kind, llmt::Estimation::joint, 8);
    options.growth.min_leaf_samples = 1;  // it counts rows, whatever their weight
    const llmt::Model expected = llmt::fit(x(repeated, Eigen::all), y(repeated, Eigen::all), options).model;
    options.weights = weights;
    const llmt::Model found = llmt::fit(x, y, options).model;
    ASSERT_EQ(found.partitions()[0].num_leaves(), 8);
    for (std::size_t i = 0; i < found.partitions()[0].nodes.size(); ++i) {
      EXPECT_EQ(found.partitions()[0].nodes[i].split_input, expected.partitions()[0].nodes[i].split_input);
      EXPECT_NEAR(found.partitions()[0].nodes[i].threshold, expected.partitions()[0].nodes[i].threshold, 1e-9);
    }
    EXPECT_LT((found.predict(query) - expected.predict(query)).cwiseAbs().maxCoeff(), 1e-5);
    options.weights = 1e3 * weights;
    EXPECT_LT((llmt::fit(x, y, options).model.predict(query) - found.predict(query)).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(Weights, ZeroIsADeletedRow) {
  Eigen::MatrixXd x = oracle::uniform(300, 3, 57);
  Eigen::MatrixXd y = oracle::curved(x, 0.1);
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(300);
  std::vector<std::ptrdiff_t> kept;
  for (std::ptrdiff_t i = 0; i < 300; ++i) {
    x(i, 2) = std::floor(2.0 * x(i, 2) + 2.0);
    if (i % 3 == 0) {
      weights(i) = 0.0;
      x.row(i) << 100.0, -100.0, 7.0;  // neither extents nor categories come from it
      y(i, 0) = 1e6;
    } else {
      kept.push_back(i);
    }
  }
  const Eigen::MatrixXd query = x(kept, Eigen::all);
  for (const Kind& kind : kinds) {
    llmt::FitOptions options = only(kind, llmt::Estimation::joint, 8);
    options.categorical_inputs = {2};
    const llmt::FitResult expected = llmt::fit(x(kept, Eigen::all), y(kept, Eigen::all), options);
    options.weights = weights;
    const llmt::FitResult found = llmt::fit(x, y, options);
    EXPECT_EQ(found.summary.samples, 200);
    EXPECT_EQ(found.model.inputs()[0].high, expected.model.inputs()[0].high);
    EXPECT_EQ(found.model.inputs()[2].levels, expected.model.inputs()[2].levels);
    EXPECT_EQ(found.model.regressors().size(), expected.model.regressors().size());
    EXPECT_LT((found.model.predict(query) - expected.model.predict(query)).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(Missing, FitsAndPredictsForEveryValidity) {
  llmt::Random random(61);
  Eigen::MatrixXd x = oracle::uniform(600, 3, 61);
  const Eigen::MatrixXd y = oracle::curved(x, 0.1);
  for (double& value : x.reshaped()) {
    value = random.uniform() < 0.1 ? nan : value;
  }
  Eigen::MatrixXd query = 2.0 * oracle::uniform(200, 3, 62);
  for (double& value : query.reshaped()) {
    value = random.uniform() < 0.3 ? nan : value;
  }
  query.row(0).setConstant(nan);
  for (const Kind& kind : kinds) {
    for (const llmt::Estimation estimation :
         {llmt::Estimation::as_grown, llmt::Estimation::local, llmt::Estimation::joint}) {
      const llmt::FitResult result = llmt::fit(x, y, only(kind, estimation, 10));
      EXPECT_EQ(result.summary.missing_values, x.array().isNaN().count());
      EXPECT_TRUE(result.model.predict(query).allFinite());
      const Eigen::MatrixXd validities = result.model.validities(query, 0);
      EXPECT_GE(validities.minCoeff(), 0.0);
      EXPECT_LT((validities.rowwise().sum().array() - 1.0).abs().maxCoeff(), 1e-12);
      EXPECT_EQ(llmt::from_json(llmt::to_json(result.model)).predict(query), result.model.predict(query));
    }
  }
  const llmt::FitResult automatic = llmt::fit(x, y);
  EXPECT_TRUE(automatic.model.predict(query).allFinite());
  EXPECT_EQ(llmt::to_json(llmt::fit(x, y).model), llmt::to_json(automatic.model));
}

TEST(Missing, ColumnWithoutAnyValueChangesNothing) {
  const Eigen::MatrixXd x = oracle::uniform(200, 2, 63);
  const Eigen::MatrixXd y = oracle::curved(x, 0.1);
  Eigen::MatrixXd wider(200, 3);
  wider << x, Eigen::VectorXd::Constant(200, nan);
  llmt::FitOptions options = only(kinds[1], llmt::Estimation::joint, 6);
  options.growth.min_leaf_samples = 8;  // its default depends on the number of inputs
  EXPECT_LT((llmt::fit(wider, y, options).model.predict(wider) - llmt::fit(x, y, options).model.predict(x))
                .cwiseAbs()
                .maxCoeff(),
            1e-6);
}

TEST(Missing, InformativeMissingnessIsLearned) {
  const auto table = [](std::uint64_t seed) {
    llmt::Random random(seed);
    Data d{oracle::uniform(1000, 3, seed), Eigen::MatrixXd(1000, 1)};
    for (std::ptrdiff_t i = 0; i < 1000; ++i) {
      const bool missing = random.uniform() < 0.3;
      d.y(i, 0) = std::sin(3.0 * d.x(i, 1)) + d.x(i, 2) + (missing ? 5.0 : 0.0) + 0.1 * random.normal();
      d.x(i, 0) = missing ? nan : d.x(i, 0);
    }
    return d;
  };
  const Data train = table(64);
  const Data test = table(65);
  // Without the difference of 5 being seen, its standard deviation of 2.3 remains.
  EXPECT_LT(llmt::rmse(llmt::fit(train.x, train.y).model.predict(test.x), test.y)(0), 0.3);
}

TEST(Missing, SplitInputThatIsMissingAtOneEndIsLearned) {
  // x1 decides between 0 and 5; where it is missing it would mostly have been high.
  const auto table = [](std::uint64_t seed) {
    llmt::Random random(seed);
    Data d{oracle::uniform(1000, 2, seed), Eigen::MatrixXd(1000, 1)};
    for (std::ptrdiff_t i = 0; i < 1000; ++i) {
      d.y(i, 0) = (d.x(i, 0) > 0.1 ? 5.0 : 0.0) + d.x(i, 1) + 0.1 * random.normal();
      d.x(i, 0) = d.x(i, 0) > 0.4 ? nan : d.x(i, 0);
    }
    return d;
  };
  const Data train = table(66);
  const Data test = table(67);
  EXPECT_LT(llmt::rmse(llmt::fit(train.x, train.y).model.predict(test.x), test.y)(0), 0.3);
}

TEST(Categorical, OffsetsAndSlopesOfLevelsAreRecovered) {
  const std::vector<double> offset = {0.0, 4.0, -3.0, 1.0};
  const std::vector<double> slope = {1.0, -2.0, 0.5, 3.0};
  llmt::Random random(71);
  Eigen::MatrixXd x = oracle::uniform(1000, 2, 71);
  Eigen::MatrixXd y(1000, 1);
  Eigen::VectorXd truth(1000);
  for (std::ptrdiff_t i = 0; i < 1000; ++i) {
    const std::size_t level = random.below(4);
    x(i, 0) = static_cast<double>(level);
    truth(i) = offset[level] + slope[level] * x(i, 1);
    y(i, 0) = truth(i) + 0.1 * random.normal();
  }
  llmt::FitOptions options;
  options.categorical_inputs = {0};
  const llmt::Model model = llmt::fit(x, y, options).model;
  EXPECT_EQ(model.inputs()[0].levels, (std::vector<std::string>{"0", "1", "2", "3"}));
  // Eight coefficients from 1000 rows leave 0.1 * sqrt(8 / 1000) = 0.009.
  EXPECT_LT(llmt::rmse(model.predict(x), truth)(0), 0.02);
  for (int level = 0; level < 4; ++level) {
    const Eigen::Vector2d point(level, 0.2);
    EXPECT_NEAR(model.jacobian(point)(0, 1), slope[static_cast<std::size_t>(level)], 0.1);
    EXPECT_EQ(model.jacobian(point)(0, 0), 0.0);
  }
  Eigen::MatrixXd query(4, 2);
  query << 4.0, 0.1, 9999.0, 0.1, -3.0, 0.1, nan, 0.1;
  const Eigen::MatrixXd unknown = model.predict(query);
  EXPECT_TRUE(unknown.allFinite());
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(unknown(i, 0), unknown(3, 0));  // as missing
  }
  const llmt::Model back = llmt::from_json(llmt::to_json(model));
  EXPECT_EQ(back.predict(x), model.predict(x));
}

TEST(Fit, MistakesInWeightsCategoriesAndBlendsAreNamed) {
  const Eigen::MatrixXd x = oracle::uniform(20, 2, 72).cwiseAbs();
  const Eigen::MatrixXd y = x.col(0);
  const auto error = [&](const std::function<void(llmt::FitOptions&)>& change) {
    llmt::FitOptions options;
    change(options);
    return message_of([&] { llmt::fit(x, y, options); });
  };
  const auto starts = [](const std::string& text, const std::string& with) {
    return text.rfind(with, 0) == 0 ? with : text;
  };
  const std::string category = error([](auto& options) { options.categorical_inputs = {1}; });
  EXPECT_EQ(starts(category, "llmt::fit: a category of input 1 is 0."), "llmt::fit: a category of input 1 is 0.");
  EXPECT_NE(category.find("it must be a whole number from 0 to 9999"), std::string::npos) << category;
  Eigen::MatrixXd halves = x;
  halves.col(1).setConstant(1.5);
  EXPECT_EQ(message_of([&] { llmt::fit(halves, y, {.categorical_inputs = {1}}); }),
            "llmt::fit: a category of input 1 is 1.5, it must be a whole number from 0 to 9999");
  EXPECT_EQ(error([](auto& options) { options.categorical_inputs = {2}; }),
            "llmt::fit: categorical_inputs names column 2, there are 2");
  EXPECT_EQ(error([](auto& options) { options.weights = Eigen::VectorXd::Constant(20, -1.0); }),
            "llmt::fit: a weight is -1, it must be at least 0");
  EXPECT_EQ(error([](auto& options) { options.weights = Eigen::VectorXd::Zero(20); }),
            "llmt::fit: the largest weight is 0, it must be positive");
  EXPECT_EQ(error([](auto& options) { options.weights = Eigen::VectorXd::Ones(19); }),
            "llmt::fit: weights has 19 entries, inputs has 20 rows");
  EXPECT_EQ(error([](auto& options) { options.blend.widths = {0.0}; }),
            "llmt::fit: blend.widths is 0, it must be finite and positive");
  EXPECT_EQ(error([](auto& options) {
              options.blend.widths = {1.0, -2.0};
            }),
            "llmt::fit: blend.widths is -2, it must be finite and positive");
  EXPECT_EQ(error([](auto& options) { options.blend.smoothness = 3; }),
            "llmt::fit: blend.smoothness is 3, it must be 1 or 2");
  EXPECT_EQ(error([](auto& options) { options.blend.ridges = {-1.0}; }),
            "llmt::fit: blend.ridges is -1, it must be finite and not negative");
  EXPECT_EQ(error([](auto& options) { options.blend.shrinkages = {nan}; }),
            "llmt::fit: blend.shrinkages is nan, it must be finite and not negative");
  const llmt::Model model = llmt::fit(x, y).model;
  Eigen::MatrixXd query = x;
  query(2, 1) = -std::numeric_limits<double>::infinity();
  EXPECT_EQ(message_of([&] { model.predict(query); }),
            "llmt::Model::predict: inputs(2, 1) is -inf, it must be finite, or NaN where it is missing (rows and "
            "columns counted from 0)");
}

}  // namespace
