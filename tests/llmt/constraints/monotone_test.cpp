// Constraints on slopes and monotone predictions: exact everywhere, and no stronger than they have to be.
#include <gtest/gtest.h>

#include <Eigen/QR>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "constraints/constrained_leaves.hpp"
#include "estimation/estimate.hpp"
#include "llmt/fit.hpp"
#include "llmt/random.hpp"
#include "numerics/bounded_least_squares.hpp"
#include "oracles/oracles.hpp"

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

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
    const Eigen::Index size = 3 + static_cast<Eigen::Index>(seed % 4);
    const Eigen::Index count = 1 + static_cast<Eigen::Index>(seed % 8);
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

// Rises with x1 but for a dip, falls with x2 but for a wave, and both depend on x3 and x4.
MatrixXd nearly_monotone(const MatrixXd& x, double noise, std::uint64_t seed) {
  llmt::Random random(seed);
  MatrixXd y(x.rows(), 1);
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    const double third = std::isnan(x(i, 2)) ? 0.5 : x(i, 2);
    y(i, 0) = (2.0 + third) * std::tanh(2.0 * x(i, 0)) - 1.5 * std::exp(-20.0 * std::pow(x(i, 0) - 0.3, 2)) -
              x(i, 1) * (1.5 + std::sin(4.0 * x(i, 1))) + 2.0 * std::abs(third) + noise * random.normal();
  }
  return y;
}

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

struct Case {
  const char* name;
  llmt::FitOptions options;
};

std::vector<Case> cases() {
  llmt::FitOptions base;
  base.max_leaves = 14;
  base.min_leaf_samples = 8;
  base.significance = 1.0;
  base.folds.count = 0;
  std::vector<Case> result = {{"crisp", base}};
  for (const double width : {0.5, 1.0, 4.0}) {
    for (const double ridge : {1e-6, 1e-2}) {
      llmt::FitOptions blend = base;
      blend.validity = llmt::ValidityChoice::blend;
      blend.expert.widths = {width};
      blend.expert.ridges = {ridge};
      result.push_back({"blend", blend});
    }
  }
  for (const llmt::Estimation estimation : {llmt::Estimation::as_grown, llmt::Estimation::local}) {
    llmt::FitOptions blend = base;
    blend.validity = llmt::ValidityChoice::blend;
    blend.expert.widths = {1.0};
    blend.expert.estimation = estimation;
    result.push_back({"blend, locally estimated", blend});
  }
  llmt::FitOptions jumps = result[1].options;
  jumps.expert.jumps = {0.1};
  result.push_back({"some jumps", jumps});
  llmt::FitOptions retis = base;
  retis.rule = llmt::GrowthRule::retis;
  retis.expert.shrinkages = {1.0};
  result.push_back({"retis", retis});
  llmt::FitOptions gaussian = base;
  gaussian.validity = llmt::ValidityChoice::gaussian;
  gaussian.expert.widths = {0.33};
  result.push_back({"gaussian", gaussian});
  llmt::FitOptions lolimot = base;
  lolimot.rule = llmt::GrowthRule::lolimot;
  for (const llmt::Estimation estimation :
       {llmt::Estimation::as_grown, llmt::Estimation::local, llmt::Estimation::joint}) {
    lolimot.expert.estimation = estimation;
    lolimot.expert.ridges = {1e-4};
    if (estimation != llmt::Estimation::joint) {
      lolimot.expert.ridges.clear();
    }
    result.push_back({"lolimot", lolimot});
  }
  return result;
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
      options.monotone = {1, -1, 0, 0};
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
      options.monotone = {1, -1, 0, 0};
      options.categorical_inputs = {3};
      options.shared_partition = seed == 1;
      options.weights = oracle::uniform(300, 1, seed).cwiseAbs();
      for (const bool lacking : {false, true}) {
        MatrixXd inputs = x;
        for (Eigen::Index i = 0; lacking && i < x.rows(); i += 7) {
          inputs(i, i % 4) = nan;
        }
        const llmt::Model model = llmt::fit(inputs, y, options).model;
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
  options.monotone = {1, -1, 0};
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
  options.monotone = {1, -1, 0};
  const llmt::Model model = llmt::fit(x, y, options).model;
  EXPECT_LE(largest_fall(model, 0, 1, 4, true), rounding);
  EXPECT_LE(largest_fall(model, 1, -1, 4, true), rounding);
}

// A table and the rows of it that a fit would train on.
struct Rows {
  llmt::Table table;
  llmt::TrainingRows training;
  Rows(const MatrixXd& x, const MatrixXd& y, const std::vector<int>& monotone)
      : table{x, y, VectorXd::Ones(x.rows()), std::vector<int>(x.cols(), 0), {}, {}} {
    for (int j = 0; j < x.cols(); ++j) {
      table.regression_inputs.push_back(j);
      table.split_inputs.push_back(j);
    }
    table.slope_signs = table.monotone = monotone;
    std::vector<int> all;
    for (int i = 0; i < x.rows(); ++i) {
      all.push_back(i);
    }
    training = llmt::training_rows(table, all);
  }
};

TEST(Monotone, TheRoomAtAJumpIsTheSmallestStepOfTheLeaves) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const MatrixXd x = oracle::uniform(200, 2, seed);
    llmt::FitOptions options;
    options.max_leaves = 4;
    options.significance = 1.0;
    options.folds.count = 0;
    const MatrixXd y = oracle::curved(x, 0.2, seed);
    const llmt::Model fitted = llmt::fit(x, y, options).model;
    llmt::Partition partition = fitted.partitions()[0];
    partition.residual_range.resize(0, 0);  // the step of the leaves, before predictions are held
    const llmt::Model model(fitted.inputs(), fitted.outputs(), fitted.regressors(), {partition});
    double smallest = std::numeric_limits<double>::infinity();
    for (const llmt::Node& node : partition.nodes) {
      if (node.split_input != 0) continue;
      constexpr Eigen::Index steps = 20001;
      MatrixXd left(steps, 2);
      left.col(0).setConstant(node.threshold);
      left.col(1) = VectorXd::LinSpaced(steps, -1.5, 1.5);
      MatrixXd right = left;
      right.col(0).setConstant(std::nextafter(node.threshold, 2.0));
      const VectorXd step = model.predict(right).col(0) - model.predict(left).col(0);
      for (Eigen::Index i = 0; i < steps; ++i) {
        // Only where this split is the one that both points are divided by.
        const MatrixXd both = (MatrixXd(2, 2) << left.row(i), right.row(i)).finished();
        const Eigen::MatrixXi leaves = model.leaf_of(both);
        smallest = leaves(0, 0) != leaves(1, 0) ? std::min(smallest, step(i)) : smallest;
      }
    }
    if (std::isfinite(smallest)) {
      const Rows rows(x, y, {1, 0});
      // Parabolas are bounded by their control points, so the margin may be a little smaller than the smallest step.
      const double margin = llmt::order_margin(partition, rows.training);
      EXPECT_LE(margin, smallest + 1e-9) << seed;
      EXPECT_GE(margin, smallest - 0.05 * y.cwiseAbs().maxCoeff()) << seed;
    }
  }
}

TEST(Monotone, ASplitAgainstTheTrendIsTheBestContinuousOrLevelOne) {
  // A falling step: the best two constants in order are one constant.
  MatrixXd x(200, 1);
  MatrixXd y(200, 1);
  for (Eigen::Index i = 0; i < 200; ++i) {
    x(i, 0) = static_cast<double>(i) / 200.0;
    y(i, 0) = (i < 100 ? 3.0 : 1.0) + 0.01 * static_cast<double>(i % 3);
  }
  llmt::FitOptions options;
  options.max_leaves = 4;
  options.significance = 1.0;
  options.folds.count = 0;
  options.monotone = {1};
  const llmt::Model model = llmt::fit(x, y, options).model;
  EXPECT_GT(model.partitions()[0].num_leaves(), 1);
  for (const llmt::Node& node : model.partitions()[0].nodes) {
    EXPECT_EQ(node.slope(0, 0), 0.0);
  }
  EXPECT_LE((model.predict(x).array() - y.mean()).abs().maxCoeff(), 1e-4);
}

TEST(SlopeSigns, AgainstTheTrendAreExactlyZeroInEveryNode) {
  const MatrixXd x = oracle::uniform(300, 2, 5);
  const MatrixXd y = -3.0 * x.col(0) + x.col(1).cwiseAbs();
  for (const Case& each : cases()) {
    llmt::FitOptions options = each.options;
    options.slope_signs = {1, 0};
    const llmt::Model model = llmt::fit(x, y, options).model;
    Eigen::Index zeros = 0;
    for (const llmt::Node& node : model.partitions()[0].nodes) {
      EXPECT_GE(node.slope(0, 0), 0.0) << each.name;
      zeros += node.slope(0, 0) == 0.0 ? 1 : 0;
    }
    EXPECT_GT(zeros, std::ssize(model.partitions()[0].nodes) / 2) << each.name;
    EXPECT_EQ(model.partitions()[0].nodes[0].slope(0, 0), 0.0) << each.name;
  }
}

TEST(SlopeSigns, ThatTheFitHasAnywayLeaveItsBytes) {
  const MatrixXd x = oracle::uniform(300, 2, 6);
  const MatrixXd y = 5.0 * x.col(0) + x.col(0).array().exp().matrix() + x.col(1).cwiseAbs();
  int strict = 0;  // leaves of a joint estimate may have slopes of any sign under a rising sum
  for (const Case& each : cases()) {
    llmt::FitOptions options = each.options;
    const llmt::Model free = llmt::fit(x, y, options).model;
    const std::vector<llmt::Node>& nodes = free.partitions()[0].nodes;
    if (std::ranges::all_of(nodes, [](const llmt::Node& node) { return node.slope(0, 0) > 0.0; })) {
      ++strict;
      options.slope_signs = {1, 0};
      EXPECT_EQ(llmt::to_json(llmt::fit(x, y, options).model), llmt::to_json(free)) << each.name;
    }
  }
  EXPECT_GE(strict, 5);
}

TEST(Monotone, CostsLittleOfWhatNotSplittingTheInputCosts) {
  const MatrixXd x = oracle::uniform(600, 2, 7);
  const MatrixXd query = oracle::uniform(500, 2, 8);
  const auto truth = [](const MatrixXd& at) -> MatrixXd {
    return 3.0 * (4.0 * at.col(0)).array().tanh().matrix() + at.col(1).cwiseAbs2();
  };
  llmt::FitOptions options = cases()[1].options;
  options.expert.widths = {0.25};
  const auto error = [&] { return llmt::rmse(llmt::fit(x, truth(x), options).model.predict(query), truth(query))(0); };
  const double free = error();
  options.monotone = {1, 0};
  const double constrained = error();
  options.split_inputs = {1};
  const double unsplit = error();
  EXPECT_LT(constrained, 1.1 * free);
  EXPECT_LT(constrained, 0.2 * unsplit);
}

TEST(Monotone, BadOptionsAreRefusedByName) {
  const MatrixXd x = oracle::uniform(50, 2, 9).cwiseAbs().array().ceil();
  const MatrixXd y = oracle::uniform(50, 1, 10);
  const auto message = [&](const llmt::FitOptions& options) -> std::string {
    try {
      llmt::fit(x, y, options);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  llmt::FitOptions options;
  options.monotone = {1};
  EXPECT_EQ(message(options), "llmt::fit: monotone has 1 entries, there are 2 inputs");
  options.monotone = {2, 0};
  EXPECT_EQ(message(options), "llmt::fit: monotone[0] is 2, it must be -1, 0 or 1");
  options.monotone = {1, 0};
  options.slope_signs = {-1, 0};
  EXPECT_EQ(message(options), "llmt::fit: slope_signs[0] is -1, it must be not the opposite of monotone");
  options.slope_signs = {};
  options.categorical_inputs = {0};
  EXPECT_EQ(message(options),
            "llmt::fit: monotone[0] is 1, it must be 0: the input is categorical, its values have no order");
}

}  // namespace
