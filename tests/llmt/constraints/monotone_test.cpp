// Monotone predictions: exact everywhere.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <vector>

#include "llmt/fit.hpp"
#include "llmt/random.hpp"
#include "oracles/monotone_data.hpp"
#include "oracles/oracles.hpp"

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using llmt::Trend;
using namespace monotone_data;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

// Where lines through a model are looked at: all over, and next to everything where it changes.
std::vector<double> stations(const llmt::Model& model, int input) {
  const llmt::InputColumn& column = model.inputs()[input];
  const double range = column.high - column.low;
  std::vector<double> at;
  for (int k = 0; k <= 120; ++k) {
    at.push_back(column.low - 0.5 * range + 2.0 * range * k / 120.0);
  }
  const auto add = [&](double value) {
    at.push_back(value);
    at.push_back(std::nextafter(value, 1e300));
    at.push_back(std::nextafter(value, -1e300));
  };
  for (const llmt::Partition& partition : model.partitions()) {
    for (const llmt::Node& node : partition.nodes) {
      if (node.split_input == input) {
        for (const double part : {-1.0, -0.999, -0.6, -0.3, 0.0, 0.3, 0.6, 0.999, 1.0}) {
          add(node.threshold + part * node.half_width);
        }
      }
      for (std::size_t k = 0; k < model.regressors().size(); ++k) {
        if (model.regressors()[k].input == input) {
          add(column.centre + node.low(k));
          add(column.centre + node.high(k));
        }
      }
    }
  }
  std::ranges::sort(at);
  at.erase(std::unique(at.begin(), at.end()), at.end());
  return at;
}

// The largest fall of sign * any output along lines in direction of an input: through points all over the box and
// outside, at its corners, at thresholds, and with missing values.
double largest_fall(const llmt::Model& model, int input, int sign, std::uint64_t seed, bool with_missing) {
  llmt::Random random(seed);
  const std::vector<double> at = stations(model, input);
  const Eigen::Index count = std::ssize(at);
  std::vector<llmt::Node> splits;
  for (const llmt::Partition& partition : model.partitions()) {
    std::ranges::copy_if(partition.nodes, std::back_inserter(splits),
                         [](const llmt::Node& node) { return !node.is_leaf(); });
  }
  double largest = 0.0;
  for (int line = 0; line < 60; ++line) {
    MatrixXd points(count, model.num_inputs());
    for (Eigen::Index j = 0; j < points.cols(); ++j) {
      const llmt::InputColumn& column = model.inputs()[j];
      double value = random.uniform(column.low, column.high);
      if (column.is_categorical()) {
        value = static_cast<double>(random.below(column.levels.size()));
      } else if (line % 4 == 1) {
        value = random.below(2) == 0 ? column.low : column.high;
      } else if (line % 4 == 2) {
        value = random.uniform(2.0 * column.low - column.high, 2.0 * column.high - column.low);
      } else if (line % 4 == 3 && !splits.empty()) {
        const llmt::Node& node = splits[random.below(splits.size())];
        value = node.split_input == j ? node.threshold + (random.uniform() - 0.5) * node.half_width : value;
      }
      points.col(j).setConstant(with_missing && random.below(4) == 0 ? nan : value);
    }
    points.col(input) = Eigen::Map<const VectorXd>(at.data(), count);
    const MatrixXd values = sign * model.predict(points);
    for (Eigen::Index o = 0; o < values.cols(); ++o) {
      double highest = values(0, o);
      for (const double value : values.col(o)) {
        highest = std::max(highest, value);
        largest = std::max(largest, highest - value);
      }
    }
  }
  return largest;
}

// Evaluation rounds sums of numbers of this size.
constexpr double rounding = 1e-12;

TEST(Monotone, PredictionsNeverFallAnywhere) {
  double unconstrained = 0.0;
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const MatrixXd x = oracle::uniform(260, 4, seed);
    const MatrixXd y = nearly_monotone(x, 0.5, seed);
    for (const Case& each : cases()) {
      llmt::FitOptions options = each.options;
      unconstrained = std::max(unconstrained, largest_fall(llmt::fit(x, y, options).model, 0, 1, seed, false));
      options.trends = {Trend::rising, Trend::falling, Trend::any, Trend::any};
      const llmt::Model model = llmt::fit(x, y, options).model;
      EXPECT_GT(model.partitions()[0].num_leaves(), 2) << each.name;
      for (const bool with_missing : {false, true}) {
        EXPECT_LE(largest_fall(model, 0, 1, seed, with_missing), rounding) << each.name << ", x1, seed " << seed;
        EXPECT_LE(largest_fall(model, 1, -1, seed, with_missing), rounding) << each.name << ", x2, seed " << seed;
      }
    }
  }
  EXPECT_GT(unconstrained, 0.3);  // so there is something to constrain
}

TEST(Monotone, HoldsWithCategoriesWeightsMissingValuesAndSharedPartitions) {
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    llmt::Random random(seed);
    MatrixXd x = oracle::uniform(300, 4, seed);
    MatrixXd y(300, 2);
    y << nearly_monotone(x, 0.5, seed), nearly_monotone(x, 0.8, seed + 10);
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      x(i, 3) = static_cast<double>(random.below(4));
      y(i, 0) += x(i, 3) == 2.0 ? 3.0 * x(i, 0) : 0.0;
    }
    for (std::size_t which : {0U, 1U, 4U}) {
      llmt::FitOptions options = cases()[which].options;
      options.trends = {Trend::rising, Trend::falling, Trend::any, Trend::any};
      options.shared_partition = seed == 1;
      const Eigen::VectorXd weights = oracle::uniform(300, 1, seed).cwiseAbs();
      for (const bool lacking : {false, true}) {
        MatrixXd inputs = x;
        for (Eigen::Index i = 0; lacking && i < x.rows(); i += 7) {
          inputs(i, i % 4) = nan;
        }
        const llmt::TrainingData data{.inputs = inputs, .outputs = y, .weights = weights, .categorical_inputs = {3}};
        const llmt::Model model = llmt::fit(data, options).model;
        for (const bool with_missing : {false, true}) {
          EXPECT_LE(largest_fall(model, 0, 1, seed, with_missing), rounding) << which << " " << lacking;
          EXPECT_LE(largest_fall(model, 1, -1, seed, with_missing), rounding) << which << " " << lacking;
        }
      }
    }
  }
}

TEST(Monotone, HoldsWhenFoldsChooseAndInTheModelsOfTheFolds) {
  const MatrixXd x = oracle::uniform(300, 3, 3);
  const MatrixXd y = nearly_monotone(x, 0.3, 3);
  llmt::FitOptions options;
  options.max_leaves = 12;
  options.folds.count = 3;
  options.trends = {Trend::rising, Trend::falling, Trend::any};
  const llmt::FitResult result = llmt::fit(x, y, options);
  EXPECT_GT(result.summary.partitions[0].leaves, 1);
  EXPECT_LE(largest_fall(result.model, 0, 1, 3, true), rounding);
  for (const llmt::Model& model : result.intervals.models()) {
    EXPECT_LE(largest_fall(model, 0, 1, 3, true), rounding);
    EXPECT_LE(largest_fall(model, 1, -1, 3, true), rounding);
  }
  options.max_threads = 1;
  EXPECT_EQ(llmt::to_json(llmt::fit(x, y, options).model), llmt::to_json(result.model));
}

TEST(Monotone, HoldsForEstimatesThatStartFromASampleAndForBins) {
  const MatrixXd x = oracle::uniform(5000, 3, 4);
  const MatrixXd y = nearly_monotone(x, 0.5, 4);
  llmt::FitOptions options = cases()[3].options;
  options.max_leaves = 6;
  options.expert.search = llmt::SplitSearch::binned;
  options.trends = {Trend::rising, Trend::falling, Trend::any};
  const llmt::Model model = llmt::fit(x, y, options).model;
  EXPECT_LE(largest_fall(model, 0, 1, 4, true), rounding);
  EXPECT_LE(largest_fall(model, 1, -1, 4, true), rounding);
}

}  // namespace
