// Intervals of rows whose weights say how well they are known.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "llmt/boosted.hpp"
#include "llmt/fit.hpp"
#include "llmt/intervals.hpp"
#include "llmt/random.hpp"
#include "llmt/spread.hpp"
#include "oracles/samples.hpp"
#include "oracles/thrown.hpp"
#include "spread/fit_spread.hpp"

namespace {

// y = 3 a + noise of the variance 1 / weight, weights from 1/16 to 16 in another unit.
struct Weighted {
  oracle::Sample rows;
  Eigen::VectorXd weights;
};

Weighted weighted(Eigen::Index rows, double unit, std::uint64_t seed) {
  llmt::Random random(seed);
  Weighted w{{Eigen::MatrixXd(rows, 2), Eigen::MatrixXd(rows, 1)}, Eigen::VectorXd(rows)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    w.rows.x.row(i) << random.uniform(), random.uniform();
    const double weight = std::pow(16.0, 2.0 * random.uniform() - 1.0);
    w.rows.y(i, 0) = 3.0 * w.rows.x(i, 0) + random.normal() / std::sqrt(weight);
    w.weights(i) = unit * weight;
  }
  return w;
}

// The share of rows inside, of those lighter than the median weight and of the others.
Eigen::Vector2d inside_by_weight(const Weighted& fresh, const llmt::Bounds& bounds, double unit) {
  Eigen::Vector2d inside = Eigen::Vector2d::Zero();
  Eigen::Vector2d rows = Eigen::Vector2d::Zero();
  for (Eigen::Index i = 0; i < fresh.weights.size(); ++i) {
    const Eigen::Index half = fresh.weights(i) < unit ? 0 : 1;
    const double y = fresh.rows.y(i, 0);
    rows(half) += 1.0;
    inside(half) += y >= bounds.lower(i, 0) && y <= bounds.upper(i, 0) ? 1.0 : 0.0;
  }
  return inside.array() / rows.array();
}

TEST(SpreadOfWeights, WidthsFollowWeightsInAnyUnit) {
  for (const double unit : {1.0, 1e-3}) {
    const Weighted train = weighted(1500, unit, 1);
    const Weighted fresh = weighted(4000, unit, 2);
    const llmt::TrainingData data{.inputs = train.rows.x, .outputs = train.rows.y, .weights = train.weights};
    const llmt::FitResult tree = llmt::fit(data);
    const llmt::BoostedModel sum = llmt::fit_boosted(data).model;
    const auto read = llmt::from_json_with_intervals(llmt::to_json(tree.model, tree.intervals));
    for (const llmt::Bounds& bounds :
         {tree.intervals.predict(fresh.rows.x, 0.9, 1, fresh.weights),
          read.intervals.predict(fresh.rows.x, 0.9, 1, fresh.weights),
          sum.intervals(fresh.rows.x, 0.9, 1, fresh.weights),
          llmt::boosted_from_json(llmt::to_json(sum)).intervals(fresh.rows.x, 0.9, 1, fresh.weights)}) {
      const Eigen::Vector2d inside = inside_by_weight(fresh, bounds, unit);
      EXPECT_NEAR(inside(0), 0.9, 0.04) << unit;
      EXPECT_NEAR(inside(1), 0.9, 0.04) << unit;
    }
    // Without weights: of a row of the median weight, whose noise is 1.
    for (const llmt::Bounds& bounds : {tree.intervals.predict(fresh.rows.x, 0.9), sum.intervals(fresh.rows.x, 0.9)}) {
      EXPECT_NEAR((bounds.upper - bounds.lower).mean(), 3.29, 0.4) << unit;
    }
  }
}

TEST(SpreadOfWeights, KnowsNoiseOfWeightsFromOtherErrors) {
  for (const double share : {0.0, 0.5, 1.0}) {
    llmt::Random random(7);
    const Eigen::Index rows = 4000;
    const Eigen::MatrixXd x = Eigen::MatrixXd::Zero(rows, 1);
    Eigen::VectorXd weights(rows);
    Eigen::VectorXd errors(rows);
    for (Eigen::Index i = 0; i < rows; ++i) {
      weights(i) = std::pow(30.0, 2.0 * random.uniform() - 1.0);
      errors(i) = std::sqrt(1.0 - share + share / weights(i)) * std::abs(random.normal());
    }
    const std::vector<llmt::InputColumn> columns(1);
    for (const llmt::Spread& spread :
         llmt::fit_spreads({x, columns, Eigen::VectorXd::Zero(rows), errors, weights}, llmt::dealt_parts(rows, 5), 5)) {
      EXPECT_NEAR(spread.noise_share, share, 0.1);
      EXPECT_NEAR(std::log(spread.usual_weight), 0.0, 0.2);
      EXPECT_NEAR(llmt::factor_of_weight(spread, spread.usual_weight), 1.0, 1e-12);
    }
  }
  EXPECT_NEAR(llmt::factor_of_weight({.noise_share = 0.75, .usual_weight = 2.0}, 0.5), std::sqrt(0.25 + 3.0), 1e-12);
}

TEST(SpreadOfWeights, OfEqualWeightsIsThatOfNone) {
  llmt::Random random(6);
  Eigen::MatrixXd x(500, 1);
  Eigen::VectorXd errors(500);
  for (Eigen::Index i = 0; i < 500; ++i) {
    x(i, 0) = random.uniform();
    errors(i) = (x(i, 0) > 0.7 ? 4.0 : 1.0) * std::abs(random.normal());
  }
  const std::vector<llmt::InputColumn> columns(1);
  const Eigen::VectorXd equal = Eigen::VectorXd::Constant(500, 0.3);
  for (const llmt::Spread& spread :
       llmt::fit_spreads({x, columns, Eigen::VectorXd::Zero(500), errors, equal}, llmt::dealt_parts(500, 5), 5)) {
    EXPECT_EQ(spread.noise_share, 0.0);
    EXPECT_FALSE(spread.nodes.empty());
  }
}

TEST(SpreadOfWeights, WeightsOfNewRowsAreChecked) {
  const oracle::Sample s = weighted(200, 1.0, 3).rows;
  const llmt::Intervals intervals = llmt::fit(s.x, s.y).intervals;
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(200);
  EXPECT_EQ(intervals.predict(s.x, 0.9, 1, weights).lower, intervals.predict(s.x, 0.9).lower);  // it knows no weights
  EXPECT_EQ(oracle::thrown([&] { intervals.predict(s.x, 0.9, 1, Eigen::VectorXd::Ones(3)); }),
            "llmt::Intervals: there are 3 weights for 200 rows");
  weights(7) = 0.0;
  EXPECT_EQ(oracle::thrown([&] { intervals.predict(s.x, 0.9, 1, weights); }),
            "llmt::Intervals: weights(7) is 0, it must be positive");
}

}  // namespace
