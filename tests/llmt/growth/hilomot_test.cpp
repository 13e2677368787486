// HILOMOT as a whole: known truth, and that every part of a model knows oblique splits and logistic gates.
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

// 0 where direction . x <= 0, else `right` + slope . x; inputs from -1 to 1. Half width 0: crisp.
llmt::Model two_leaves(const Eigen::VectorXd& direction, double right, double half_width = 0.0,
                       const Eigen::VectorXd& slope = {}) {
  const auto node = [&](double value) {
    llmt::Node made;
    made.rss = Eigen::VectorXd::Zero(1);
    made.value = Eigen::VectorXd::Constant(1, value);
    made.slope = Eigen::MatrixXd::Zero(1, direction.size());
    made.mean = Eigen::VectorXd::Zero(direction.size());
    made.low = Eigen::VectorXd::Constant(direction.size(), -9.0);
    made.high = Eigen::VectorXd::Constant(direction.size(), 9.0);
    return made;
  };
  llmt::Partition partition{.outputs = {0}, .validity = {}, .nodes = {node(0.0), node(0.0), node(right)}};
  if (half_width > 0.0) {
    partition.validity = {llmt::ValidityKind::logistic, 1.0, 1};
  }
  if (slope.size() > 0) {
    partition.nodes[2].slope = slope.transpose();
  }
  llmt::Node& root = partition.nodes[0];
  root.left = 1;
  root.right = 2;
  root.direction = direction;
  root.half_width = half_width;
  direction.cwiseAbs().maxCoeff(&root.split_input);
  std::vector<llmt::InputColumn> inputs;
  std::vector<llmt::Regressor> regressors;
  for (int j = 0; j < direction.size(); ++j) {
    inputs.push_back({.name = "x" + std::to_string(j), .low = -1.0, .high = 1.0});
    regressors.push_back({.input = j});
  }
  return {inputs, {{.name = "y", .low = 0.0, .high = 1.0}}, regressors, {partition}};
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
  llmt::FitOptions options = hilomot(6);
  options.categorical_inputs = {3};
  options.weights = Eigen::VectorXd::Ones(500);
  options.weights.tail(250).setConstant(2.0);
  const llmt::Model model = llmt::fit(x, y, options).model;
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
  options.shared_partition = true;
  EXPECT_TRUE(llmt::fit(x, y, options).model.predict(x).allFinite());
}

TEST(Hilomot, JacobianIsThatOfDifferences) {
  const Eigen::MatrixXd x = oracle::uniform(400, 3, 91);
  const llmt::Model model = llmt::fit(x, oracle::curved(x, 0.01), hilomot(8)).model;
  const Eigen::MatrixXd points = 1.1 * oracle::uniform(40, 3, 92);
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const Eigen::VectorXd point = points.row(i).transpose();
    const Eigen::MatrixXd jacobian = model.jacobian(point);
    for (int j = 0; j < 3; ++j) {
      const double step = 1e-6;
      const Eigen::VectorXd along = step * Eigen::VectorXd::Unit(3, j);
      const double difference =
          (model.predict((point + along).transpose())(0) - model.predict((point - along).transpose())(0)) /
          (2.0 * step);
      EXPECT_NEAR(jacobian(0, j), difference, 1e-5 * (1.0 + std::abs(difference)));
    }
  }
}

TEST(Hilomot, SharesOfTheInputsAreThoseOfTheIntegral) {
  const Eigen::MatrixXd x = oracle::uniform(400, 3, 101);
  const llmt::Model model = llmt::fit(x, oracle::curved(x, 0.01), hilomot(6)).model;
  const Eigen::VectorXd reference = llmt::reference_point(model);
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Eigen::VectorXd point = oracle::uniform(1, 3, seed).row(0).transpose();
    const llmt::Attribution found = llmt::attribute(model, point);
    Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(3);
    constexpr int steps = 4000;
    for (int k = 0; k < steps; ++k) {
      sum += model.jacobian(reference + (k + 0.5) / steps * (point - reference)).row(0);
    }
    const Eigen::RowVectorXd expected = sum.cwiseProduct((point - reference).transpose()) / steps;
    EXPECT_LT((found.contributions.row(0) - expected).cwiseAbs().maxCoeff(), 1e-5);
    EXPECT_NEAR(found.contributions.sum(), (found.prediction - found.reference)(0), 1e-10);
  }
}

TEST(Hilomot, AJumpAtAPlaneIsSharedAsASteepGateDoes) {
  const Eigen::Vector3d direction(2.0, -1.0, 0.0);
  const Eigen::Vector3d reference(-0.5, 0.1, 0.3);
  const Eigen::Vector3d point(0.7, -0.6, -0.9);
  const llmt::Attribution jump = llmt::attribute(two_leaves(direction, 4.0), point, reference);
  // s goes from -1.1 to 2: the first input moves it by 2.4, the second by 0.7.
  EXPECT_NEAR(jump.contributions(0, 0), 4.0 * 2.4 / 3.1, 1e-12);
  EXPECT_NEAR(jump.contributions(0, 1), 4.0 * 0.7 / 3.1, 1e-12);
  EXPECT_EQ(jump.contributions(0, 2), 0.0);
  const llmt::Attribution steep = llmt::attribute(two_leaves(direction, 4.0, 1e-4), point, reference);
  EXPECT_LT((steep.contributions - jump.contributions).cwiseAbs().maxCoeff(), 1e-8);
  // A value that is missing at one end is switched in the middle, and with it what the split compares.
  const llmt::Attribution switched =
      llmt::attribute(two_leaves(direction, 4.0), Eigen::Vector3d(0.1, missing, 0.0), Eigen::Vector3d(0.1, 0.4, 0.0));
  EXPECT_EQ(switched.contributions(0, 1), 4.0);
}

TEST(Hilomot, LargestJumpIsThatAcrossThePlane) {
  const Eigen::Vector3d direction(0.3, -1.0, 2.0);
  const Eigen::MatrixXd x = oracle::uniform(50, 3, 111);
  EXPECT_NEAR(llmt::largest_jump(two_leaves(direction, 4.0), x), 4.0, 1e-9);
  EXPECT_EQ(llmt::largest_jump(two_leaves(direction, 4.0, 0.1), x), 0.0);
  const Eigen::Vector3d slope(1.0, -2.0, 0.7);
  double expected = 0.0;
  for (const auto row : x.rowwise()) {
    const Eigen::Vector3d on_plane = row.transpose() - direction * (row * direction)(0) / direction.squaredNorm();
    expected = std::max(expected, std::abs(4.0 + slope.dot(on_plane)));
  }
  EXPECT_NEAR(llmt::largest_jump(two_leaves(direction, 4.0, 0.0, slope), x), expected, 1e-9);
}

TEST(Hilomot, LeavesTellOnWhichSidesOfPlanesTheyLie) {
  llmt::FitOptions options = hilomot(7);
  options.validity = llmt::ValidityChoice::crisp;
  const Eigen::MatrixXd x = oracle::uniform(400, 3, 121);
  const llmt::Model model = llmt::fit(x, oracle::curved(x), options).model;
  const std::vector<llmt::Leaf> leaves = model.leaves(0);
  const Eigen::MatrixXi leaf_of = model.leaf_of(x);
  ASSERT_GT(leaves.size(), 3U);
  std::vector<Eigen::Index> rows(leaves.size(), 0);
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    for (std::size_t k = 0; k < leaves.size(); ++k) {
      bool inside = true;
      for (const llmt::ObliqueSide& side : leaves[k].sides) {
        const llmt::Node& node = model.partitions()[0].nodes[side.node];
        double s = 0.0;
        for (int j = 0; j < 3; ++j) {
          s += node.direction(j) * (x(i, j) - model.inputs()[j].centre);
        }
        inside = inside && (s <= node.threshold) == side.left;
      }
      EXPECT_EQ(inside, leaf_of(i, 0) == static_cast<int>(k));
      rows[k] += inside ? 1 : 0;
    }
  }
  for (std::size_t k = 0; k < leaves.size(); ++k) {
    EXPECT_EQ(rows[k], leaves[k].samples);
  }
}

TEST(Hilomot, FileReadsBackAndTellsWhatIsWrongWithADirection) {
  const Eigen::MatrixXd x = oracle::uniform(200, 3, 131);
  const llmt::Model model = llmt::fit(x, oracle::curved(x), hilomot(4)).model;
  const std::string text = llmt::to_json(model);
  EXPECT_NE(text.find("\"direction\""), std::string::npos);
  EXPECT_EQ(llmt::to_json(llmt::from_json(text)), text);
  const auto error_of = [&](const auto& change, llmt::ValidityKind kind = llmt::ValidityKind::logistic,
                            const std::vector<std::string>& levels = {}) -> std::string {
    llmt::Partition partition = model.partitions()[0];
    partition.validity.kind = kind;
    change(partition.nodes[0]);
    std::vector<llmt::InputColumn> inputs = model.inputs();
    inputs.push_back({.name = "kind", .levels = levels});
    for (llmt::Node& node : partition.nodes) {
      if (node.is_oblique() && node.direction.size() == 3) {
        node.direction.conservativeResizeLike(Eigen::VectorXd::Zero(4));
      }
    }
    try {
      llmt::Model(inputs, model.outputs(), model.regressors(), {partition});
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "accepted";
  };
  const auto set = [](int entry, double value) {
    return [=](llmt::Node& node) {
      node.direction.conservativeResizeLike(Eigen::VectorXd::Zero(4));
      node.direction(entry) = value;
    };
  };
  EXPECT_EQ(error_of([](llmt::Node&) {}), "accepted");
  const std::string where = "llmt::Model: partition 0 node 0: ";
  EXPECT_EQ(error_of([](llmt::Node& node) {
              node.direction.resize(2);
              node.direction.setOnes();
            }),
            where + "direction has 2 entries, it must have 4 finite ones");
  EXPECT_EQ(error_of(set(1, missing)), where + "direction has 4 entries, it must have 4 finite ones");
  const int main_input = model.partitions()[0].nodes[0].split_input;
  EXPECT_EQ(error_of(set(main_input, 0.0)),
            where + "direction has weight 0 for the split input " + std::to_string(main_input));
  EXPECT_EQ(error_of(set(3, 0.5), llmt::ValidityKind::logistic, {"a", "b"}),
            where + "direction has weight 0.5 for the categorical input \"kind\", it must be 0");
  EXPECT_EQ(error_of([](llmt::Node&) {}, llmt::ValidityKind::gaussian),
            "llmt::Model: partition 0: Gaussians need boxes, and a node has a direction");
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
