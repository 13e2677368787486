// HILOMOT as a whole, on known truth.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "llmt/compare.hpp"
#include "llmt/explain.hpp"
#include "llmt/fit.hpp"
#include "oracles/oracles.hpp"
#include "oracles/thrown.hpp"

namespace {

using llmt::Estimation;

constexpr double missing = std::numeric_limits<double>::quiet_NaN();

// As many leaves as asked for.
llmt::FitOptions hilomot(Eigen::Index leaves, Estimation estimation = Estimation::joint) {
  llmt::FitOptions options;
  options.rule = llmt::GrowthRule::hilomot;
  options.max_leaves = leaves;
  options.expert.estimation = estimation;
  options.folds.count = 0;
  return options;
}

Eigen::VectorXd unit_vector(Eigen::Index size, std::uint64_t seed) {
  llmt::Random random(seed);
  Eigen::VectorXd result(size);
  for (double& entry : result) {
    entry = random.normal();
  }
  return result.normalized();
}

// In degrees, without regard to the sense.
double angle(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  return std::acos(std::min(1.0, std::abs(a.normalized().dot(b.normalized())))) * 180.0 / std::numbers::pi;
}

TEST(Hilomot, RecoversTheGateThatMadeTheData) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Eigen::VectorXd w = unit_vector(4, seed);
    const Eigen::MatrixXd x = oracle::uniform(400, 4, seed + 10);
    const Eigen::ArrayXd side = x * w;
    const Eigen::ArrayXd share = (1.0 + ((side - 0.1) / 0.15).exp()).inverse();
    const Eigen::ArrayXd left = x * Eigen::Vector4d(1.0, 0.0, 2.0, -1.0);
    const Eigen::ArrayXd right = 1.0 + (x * Eigen::Vector4d(-1.0, 3.0, 0.0, 0.5)).array();
    const llmt::Model model = llmt::fit(x, (share * left + (1.0 - share) * right).matrix(), hilomot(2)).model;
    const llmt::Node& root = model.partitions()[0].nodes[0];
    EXPECT_LT(angle(root.direction, w), 1e-3) << seed;
    EXPECT_NEAR(root.half_width / root.direction.norm(), 0.15, 1e-5) << seed;
    double origin = root.threshold;  // s at x = 0 is minus this, plus the threshold
    for (int j = 0; j < 4; ++j) {
      origin += root.direction(j) * model.inputs()[j].centre;
    }
    EXPECT_NEAR(origin / root.direction.dot(w), 0.1, 1e-5) << seed;
  }
}

TEST(Hilomot, FindsTheDirectionOfARidge) {
  for (const Estimation estimation : {Estimation::local, Estimation::joint}) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      const Eigen::VectorXd w = unit_vector(4, seed);
      // Inputs of very different units: the direction is that of the function, not of the numbers.
      const Eigen::Vector4d units(1.0, 1000.0, 0.01, 1.0);
      const Eigen::MatrixXd x = oracle::uniform(600, 4, seed + 10);
      llmt::Random random(seed);
      Eigen::VectorXd y = (3.0 * (x * w).array()).sin();
      for (double& value : y) {
        value += 0.02 * random.normal();
      }
      const llmt::Model model = llmt::fit(x * units.asDiagonal(), y, hilomot(6, estimation)).model;
      // Pieces of a sine are not affine, so what is left of it in the sample moves directions a little.
      for (const llmt::Node& node : model.partitions()[0].nodes) {
        if (!node.is_leaf()) {
          EXPECT_LT(angle(units.cwiseProduct(node.direction), w), 8.0) << seed;
        }
      }
    }
  }
}

TEST(Hilomot, IsBetterOnARidgeThanLolimotWithAsManyLeaves) {
  for (const Estimation estimation : {Estimation::as_grown, Estimation::joint}) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      const Eigen::VectorXd w = unit_vector(3, seed);
      const Eigen::MatrixXd x = oracle::uniform(500, 3, seed + 30);
      const Eigen::MatrixXd query = 0.95 * oracle::uniform(1000, 3, seed + 60);
      const auto truth = [&](const Eigen::MatrixXd& rows) -> Eigen::MatrixXd {
        return (3.0 * (rows * w).array()).sin();
      };
      llmt::FitOptions options = hilomot(8, estimation);
      const double oblique = llmt::rmse(llmt::fit(x, truth(x), options).model.predict(query), truth(query))(0);
      options.rule = llmt::GrowthRule::lolimot;
      const double orthogonal = llmt::rmse(llmt::fit(x, truth(x), options).model.predict(query), truth(query))(0);
      EXPECT_LT(oblique, 0.5 * orthogonal) << seed;
    }
  }
}

TEST(Hilomot, AffineDataNeedOneLeafAndNoiseIsNotSplit) {
  const Eigen::MatrixXd x = oracle::uniform(300, 3, 41);
  const Eigen::VectorXd affine = (x * Eigen::Vector3d(1.0, -2.0, 0.5)).array() + 1e6;
  const llmt::FitResult exact = llmt::fit(x, affine, hilomot(0));
  EXPECT_EQ(exact.summary.partitions[0].leaves, 1);
  EXPECT_EQ(exact.summary.partitions[0].stop, llmt::StopReason::exact_fit);
  llmt::Random random(42);
  Eigen::VectorXd noisy = affine;
  for (double& value : noisy) {
    value += random.normal();
  }
  // With folds least squares stays, for the gain of the best candidate is within chance.
  llmt::FitOptions folds = hilomot(6);
  folds.folds.count = 4;
  EXPECT_EQ(llmt::fit(x, noisy, folds).summary.partitions[0].leaves, 1);
}

// A leaf has 3 coefficients and a plane 2 weights, so M leaves have k = 5 M - 2 parameters. At M = 20 of N = 300 rows a
// further parameter adds about 2 N^2 / (N - k)^2 = 4.4 to AICc, so a further leaf must lower the error by 5 * 4.4 / N =
// 7 %. Five parameters fitted to noise lower it by 5 / (N - k) = 2.5 %. The target is curved along both inputs, and one
// plane cannot follow that.
TEST(Hilomot, AiccKeepsFewerLeavesThanRowsBear) {
  const Eigen::MatrixXd x = oracle::uniform(300, 2, 45);
  for (const Estimation estimation : {Estimation::local, Estimation::joint}) {
    const llmt::FitResult result = llmt::fit(x, oracle::curved(x, 0.1), hilomot(0, estimation));
    EXPECT_EQ(result.summary.partitions[0].stop, llmt::StopReason::aicc);
    EXPECT_GE(result.summary.partitions[0].leaves, 3);
    EXPECT_LE(result.summary.partitions[0].leaves, 20);
  }
}

TEST(Hilomot, SelectionPrefersGatesOnASmoothRidgeAndKeepsIntervals) {
  const Eigen::MatrixXd x = oracle::uniform(300, 3, 51);
  const Eigen::VectorXd w = unit_vector(3, 52);
  llmt::Random random(53);
  Eigen::VectorXd y = (3.0 * (x * w).array()).sin();
  for (double& value : y) {
    value += 0.05 * random.normal();
  }
  llmt::FitOptions options = hilomot(6);
  options.folds.count = 4;
  const llmt::FitResult result = llmt::fit(x, y, options);
  EXPECT_EQ(result.summary.partitions[0].chosen.candidate.validity.kind, llmt::ValidityKind::logistic);
  EXPECT_LT(result.summary.partitions[0].chosen.rmse, 0.07);
  const llmt::Bounds bounds = result.intervals.predict(x, 0.9);
  const auto inside = y.array() >= bounds.lower.col(0).array() && y.array() <= bounds.upper.col(0).array();
  EXPECT_GE(inside.count(), 260);
}

TEST(Hilomot, SameBytesAtAnyNumberOfThreads) {
  const Eigen::MatrixXd x = oracle::uniform(400, 4, 61);
  Eigen::MatrixXd y(400, 2);
  y << oracle::curved(x, 0.05), oracle::curved(-x, 0.05, 8);
  for (const bool shared : {false, true}) {
    llmt::FitOptions options = hilomot(7);
    options.shared_partition = shared;
    options.max_threads = 1;
    const std::string one = llmt::to_json(llmt::fit(x, y, options).model);
    options.max_threads = 3;
    EXPECT_EQ(llmt::to_json(llmt::fit(x, y, options).model), one);
  }
}

TEST(Hilomot, DoesNotDependOnUnitsBeyondRounding) {
  const Eigen::MatrixXd x = oracle::coarse(oracle::uniform(300, 3, 71));
  const Eigen::MatrixXd y = oracle::coarse(oracle::curved(x, 0.05));
  const Eigen::MatrixXd query = oracle::coarse(0.9 * oracle::uniform(200, 3, 72));
  const Eigen::MatrixXd expected = llmt::fit(x, y, hilomot(6)).model.predict(query);
  const Eigen::Array3d scale(1024.0, 0x1p-10, 1.0);
  const Eigen::Array3d offset(4096.0, 0.0, 1e6);
  const auto moved = [&](const Eigen::MatrixXd& rows) -> Eigen::MatrixXd {
    return (rows.array().rowwise() * scale.transpose()).rowwise() + offset.transpose();
  };
  const llmt::Model model = llmt::fit(moved(x), (y.array() * 0x1p-20 + 64.0).matrix(), hilomot(6)).model;
  const Eigen::MatrixXd found = (model.predict(moved(query)).array() - 64.0) * 0x1p20;
  // The optimisation stops at a gain of 1e-5; on the way to there rounding decides nothing.
  EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-4);
}

TEST(Hilomot, MissingValuesCategoriesWeightsAndSeveralOutputs) {
  llmt::Random random(81);
  Eigen::MatrixXd x = oracle::uniform(500, 4, 82);
  Eigen::MatrixXd y(500, 2);
  for (Eigen::Index i = 0; i < 500; ++i) {
    x(i, 3) = std::floor(random.uniform(0.0, 3.0));
    const double s = x(i, 0) + x(i, 1);
    y(i, 0) = std::abs(s) + (x(i, 3) == 1.0 ? 5.0 * x(i, 2) : 0.0);
    y(i, 1) = std::abs(s);
    if (i % 10 == 0) {
      x(i, i % 3) = missing;
    }
  }
  llmt::TrainingData data{.inputs = x, .outputs = y, .weights = Eigen::VectorXd::Ones(500), .categorical_inputs = {3}};
  data.weights.tail(250).setConstant(2.0);
  const llmt::Model model = llmt::fit(data, hilomot(6)).model;
  // The slopes of one category are its own: that is worth more than any plane, and stays a split on categories.
  const llmt::Node& root = model.partitions()[0].nodes[0];
  EXPECT_EQ(root.split_input, 3);
  EXPECT_FALSE(root.is_oblique());
  ASSERT_EQ(root.level_side.size(), 3U);
  EXPECT_NE(root.level_side[1], root.level_side[0]);
  EXPECT_EQ(root.level_side[2], root.level_side[0]);
  for (const llmt::Partition& partition : model.partitions()) {
    for (const llmt::Node& node : partition.nodes) {
      EXPECT_TRUE(!node.is_oblique() || node.direction(3) == 0.0);
    }
  }
  // In directions a missing number is its centre, and in local models the mean, which is the same here.
  const llmt::Model numbers = llmt::fit(x.leftCols(3), y, hilomot(6)).model;
  Eigen::MatrixXd query = 0.9 * oracle::uniform(50, 3, 83);
  query.col(1).setConstant(missing);
  const Eigen::MatrixXd without = numbers.predict(query);
  query.col(1).setConstant(numbers.inputs()[1].centre);
  EXPECT_LT((without - numbers.predict(query)).cwiseAbs().maxCoeff(), 1e-12);
  llmt::FitOptions options = hilomot(6);
  options.shared_partition = true;
  EXPECT_TRUE(llmt::fit(data, options).model.predict(x).allFinite());
}

TEST(Hilomot, RefusesOtherValidities) {
  const Eigen::MatrixXd x = oracle::uniform(50, 2, 141);
  llmt::FitOptions options = hilomot(3);
  for (const llmt::ValidityChoice validity : {llmt::ValidityChoice::gaussian, llmt::ValidityChoice::blend}) {
    options.validity = validity;
    EXPECT_EQ(oracle::thrown([&] { llmt::fit(x, x.col(0), options); }).find("llmt::fit: validity"), 0U);
  }
}

TEST(Hilomot, CopesWithConstantDuplicatedAndFewRows) {
  Eigen::MatrixXd x = oracle::uniform(60, 4, 151);
  x.col(2).setConstant(3.0);
  x.col(3) = x.col(0);
  const Eigen::MatrixXd y = oracle::curved(x);
  EXPECT_TRUE(llmt::fit(x, y, hilomot(10)).model.predict(x).allFinite());
  EXPECT_EQ(llmt::fit(x.topRows(3), y.topRows(3), hilomot(10)).summary.partitions[0].leaves, 1);
  const Eigen::MatrixXd constant = Eigen::MatrixXd::Constant(60, 1, 2.0);
  EXPECT_EQ(llmt::fit(x, constant, hilomot(10)).summary.partitions[0].leaves, 1);
  EXPECT_EQ(llmt::fit(constant, y, hilomot(10)).summary.partitions[0].leaves, 1);
}

}  // namespace
