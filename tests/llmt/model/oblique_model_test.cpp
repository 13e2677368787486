// Models with oblique splits and logistic gates: every part of a model knows them.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "llmt/compare.hpp"
#include "llmt/explain.hpp"
#include "llmt/fit.hpp"
#include "oracles/oracles.hpp"
#include "oracles/samples.hpp"

namespace {

using oracle::missing;

// A model of HILOMOT with the given number of leaves.
llmt::FitOptions hilomot(Eigen::Index leaves) {
  llmt::FitOptions options;
  options.rule = llmt::GrowthRule::hilomot;
  options.max_leaves = leaves;
  options.expert.estimation = llmt::Estimation::joint;
  options.folds.count = 0;
  return options;
}

// 0 where direction . x <= 0, else `right` + slope . x; inputs from -9 to 9. Half width 0: crisp.
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
    inputs.push_back({.name = "x" + std::to_string(j), .low = -9.0, .high = 9.0});
    regressors.push_back({.input = j});
  }
  return {inputs, {{.name = "y", .low = 0.0, .high = 1.0}}, regressors, {partition}};
}

TEST(ObliqueModel, JacobianIsThatOfDifferences) {
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

TEST(ObliqueModel, SharesOfTheInputsAreThoseOfTheIntegral) {
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

TEST(ObliqueModel, AJumpAtAPlaneIsSharedAsASteepGateDoes) {
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

TEST(ObliqueModel, LargestJumpIsThatAcrossThePlane) {
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

TEST(ObliqueModel, LeavesTellOnWhichSidesOfPlanesTheyLie) {
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

TEST(ObliqueModel, FileReadsBackAndTellsWhatIsWrongWithADirection) {
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

}  // namespace
