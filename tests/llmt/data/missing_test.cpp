// Missing values and categories.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "llmt/random.hpp"
#include "oracles/random_trees.hpp"
#include "oracles/samples.hpp"

namespace {

using namespace random_trees;

TEST(Fit, SameBytesAtAnyNumberOfThreadsWithCategoriesAndMissingValues) {
  llmt::Random random(51);
  Eigen::MatrixXd x = oracle::uniform(400, 3, 51);
  const Eigen::MatrixXd y = oracle::curved(x, 0.1);
  for (Eigen::Index i = 0; i < 400; ++i) {
    x(i, 1) = std::floor(2.0 * x(i, 1) + 2.0);
    if (i % 5 == 0) {
      x(i, random.below(3)) = oracle::missing;
    }
  }
  for (const llmt::ValidityChoice choice : {llmt::ValidityChoice::automatic, llmt::ValidityChoice::gaussian}) {
    std::vector<std::string> models;
    for (const int threads : {1, 2, 8}) {
      llmt::FitOptions options;
      options.validity = choice;
      options.max_threads = threads;
      const llmt::TrainingData data{.inputs = x, .outputs = y, .categorical_inputs = {1}};
      models.push_back(llmt::to_json(llmt::fit(data, options).model));
    }
    EXPECT_EQ(models[0], models[1]);
    EXPECT_EQ(models[0], models[2]);
  }
}

TEST(Missing, FitsAndPredictsForEveryValidity) {
  llmt::Random random(61);
  Eigen::MatrixXd x = oracle::uniform(600, 3, 61);
  const Eigen::MatrixXd y = oracle::curved(x, 0.1);
  for (double& value : x.reshaped()) {
    value = random.uniform() < 0.1 ? oracle::missing : value;
  }
  Eigen::MatrixXd query = 2.0 * oracle::uniform(200, 3, 62);
  for (double& value : query.reshaped()) {
    value = random.uniform() < 0.3 ? oracle::missing : value;
  }
  query.row(0).setConstant(oracle::missing);
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
  wider << x, Eigen::VectorXd::Constant(200, oracle::missing);
  llmt::FitOptions options = only(kinds[1], llmt::Estimation::joint, 6);
  options.min_leaf_samples = 8;  // its default depends on the number of inputs
  EXPECT_LT((llmt::fit(wider, y, options).model.predict(wider) - llmt::fit(x, y, options).model.predict(x))
                .cwiseAbs()
                .maxCoeff(),
            1e-6);
}

TEST(Missing, InformativeMissingnessIsLearned) {
  const auto table = [](std::uint64_t seed) {
    llmt::Random random(seed);
    Data d{oracle::uniform(1000, 3, seed), Eigen::MatrixXd(1000, 1)};
    for (Eigen::Index i = 0; i < 1000; ++i) {
      const bool is_missing = random.uniform() < 0.3;
      d.y(i, 0) = std::sin(3.0 * d.x(i, 1)) + d.x(i, 2) + (is_missing ? 5.0 : 0.0) + 0.1 * random.normal();
      d.x(i, 0) = is_missing ? oracle::missing : d.x(i, 0);
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
    for (Eigen::Index i = 0; i < 1000; ++i) {
      d.y(i, 0) = (d.x(i, 0) > 0.1 ? 5.0 : 0.0) + d.x(i, 1) + 0.1 * random.normal();
      d.x(i, 0) = d.x(i, 0) > 0.4 ? oracle::missing : d.x(i, 0);
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
  for (Eigen::Index i = 0; i < 1000; ++i) {
    const std::size_t level = random.below(4);
    x(i, 0) = static_cast<double>(level);
    truth(i) = offset[level] + slope[level] * x(i, 1);
    y(i, 0) = truth(i) + 0.1 * random.normal();
  }
  const llmt::Model model = llmt::fit({.inputs = x, .outputs = y, .categorical_inputs = {0}}).model;
  EXPECT_EQ(model.inputs()[0].levels, (std::vector<std::string>{"0", "1", "2", "3"}));
  // Eight coefficients from 1000 rows leave 0.1 * sqrt(8 / 1000) = 0.009.
  EXPECT_LT(llmt::rmse(model.predict(x), truth)(0), 0.02);
  for (int level = 0; level < 4; ++level) {
    const Eigen::Vector2d point(level, 0.2);
    EXPECT_NEAR(model.jacobian(point)(0, 1), slope[level], 0.1);
    EXPECT_EQ(model.jacobian(point)(0, 0), 0.0);
  }
  Eigen::MatrixXd query(4, 2);
  query << 4.0, 0.1, 9999.0, 0.1, -3.0, 0.1, oracle::missing, 0.1;
  const Eigen::MatrixXd unknown = model.predict(query);
  EXPECT_TRUE(unknown.allFinite());
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(unknown(i, 0), unknown(3, 0));  // as missing
  }
  const llmt::Model back = llmt::from_json(llmt::to_json(model));
  EXPECT_EQ(back.predict(x), model.predict(x));
}

}  // namespace
