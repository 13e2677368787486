// The parts of a readable tree, held against brute force and closed forms.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <limits>

#include "llmt/random.hpp"
#include "readable/cost_complexity.hpp"
#include "readable/decimal.hpp"
#include "readable/leaf_equations.hpp"

namespace {

using llmt::PricedNode;

// A tree in which every node but the last few may be split, with equations of one to three lengths.
std::vector<PricedNode> random_tree(llmt::Random& random, int splits) {
  std::vector<PricedNode> nodes(1);
  for (int split = 0; split < splits; ++split) {
    std::vector<int> leaves;
    for (int i = 0; i < static_cast<int>(nodes.size()); ++i) {
      if (nodes[i].left < 0) leaves.push_back(i);
    }
    const int at = leaves[static_cast<std::size_t>(random.uniform(0.0, static_cast<double>(leaves.size()) - 1e-9))];
    nodes[at].left = static_cast<int>(nodes.size());
    nodes[at].right = nodes[at].left + 1;
    nodes[at].split_size = 3 + split % 3;
    nodes.resize(nodes.size() + 2);
  }
  for (PricedNode& node : nodes) {
    double error = random.uniform(0.5, 2.0);
    for (int k = 0; k < 3; ++k) {
      node.errors.push_back(error);
      node.sizes.push_back(1 + 4 * k);
      error *= random.uniform(0.3, 1.0);
    }
  }
  return nodes;
}

// The costs of all trees below a node.
std::vector<double> all_costs(const std::vector<PricedNode>& nodes, int at, double price) {
  const PricedNode& node = nodes[at];
  std::vector<double> costs;
  for (std::size_t k = 0; k < node.errors.size(); ++k) {
    costs.push_back(node.errors[k] + price * static_cast<double>(node.sizes[k]));
  }
  if (node.left < 0) return costs;
  for (const double left : all_costs(nodes, node.left, price)) {
    for (const double right : all_costs(nodes, node.right, price)) {
      costs.push_back(left + right + price * static_cast<double>(node.split_size));
    }
  }
  return costs;
}

struct Cost {
  double error = 0.0;
  Eigen::Index size = 0;
};

Cost cost_of(const std::vector<PricedNode>& nodes, const std::vector<int>& pruned) {
  Cost cost;
  for (const int node : llmt::nodes_of(nodes, pruned)) {
    const bool split = pruned[node] == llmt::stays_split;
    cost.size += split ? nodes[node].split_size : nodes[node].sizes[pruned[node]];
    cost.error += split ? 0.0 : nodes[node].errors[pruned[node]];
  }
  return cost;
}

TEST(CostComplexity, CheapestTreeEqualsBruteForceOverAllTreesAndEquations) {
  llmt::Random random(1);
  for (int repeat = 0; repeat < 40; ++repeat) {
    const std::vector<PricedNode> nodes = random_tree(random, 1 + repeat % 4);
    for (const double price : {0.0, 0.01, 0.05, 0.2, 1.0}) {
      const Cost found = cost_of(nodes, llmt::cheapest_tree(nodes, price));
      const std::vector<double> all = all_costs(nodes, 0, price);
      EXPECT_NEAR(found.error + price * static_cast<double>(found.size), *std::ranges::min_element(all), 1e-12);
    }
  }
}

TEST(CostComplexity, ATreeNeverGrowsWithThePrice) {
  llmt::Random random(2);
  for (int repeat = 0; repeat < 20; ++repeat) {
    const std::vector<PricedNode> nodes = random_tree(random, 5);
    Eigen::Index before = std::numeric_limits<Eigen::Index>::max();
    for (double price = 1e-4; price < 10.0; price *= 1.5) {
      const Eigen::Index size = cost_of(nodes, llmt::cheapest_tree(nodes, price)).size;
      EXPECT_LE(size, before);
      before = size;
    }
    EXPECT_EQ(before, 1);
  }
}

TEST(Decimal, RoundsToTheNearestMultipleAndPrintsItsDigits) {
  EXPECT_EQ(llmt::rounded(0.123456, -3), 0.123);
  EXPECT_EQ(llmt::rounded(-0.0004, -3), 0.0);
  EXPECT_FALSE(std::signbit(llmt::rounded(-0.0004, -3)));
  EXPECT_EQ(llmt::rounded(1234567.0, 3), 1235000.0);
  EXPECT_EQ(llmt::rounded(2.675, -1), 2.7);
  EXPECT_EQ(llmt::exponent_below(0.1), -1);
  EXPECT_EQ(llmt::exponent_below(0.0999), -2);
  EXPECT_EQ(llmt::exponent_below(1000.0), 3);
  EXPECT_EQ(llmt::exponent_below(999.999), 2);
}

TEST(Decimal, NoNumberInTheGapIsShorterThanTheOneThatIsTaken) {
  llmt::Random random(3);
  for (int repeat = 0; repeat < 2000; ++repeat) {
    const double low = random.uniform(-50.0, 50.0);
    const double high = low + std::pow(10.0, random.uniform(-8.0, 1.5));
    const double taken = llmt::shortest_between(low, high);
    ASSERT_GE(taken, low);
    ASSERT_LT(taken, high);
    // The smallest power of ten that divides it, and no multiple of the next larger one in the gap.
    int exponent = 3;
    while (llmt::rounded(taken, exponent) != taken) --exponent;
    const double unit = std::pow(10.0, exponent + 1);
    if (exponent < 2) {
      const double multiple = std::ceil(low / unit) * unit;
      EXPECT_GE(multiple, high - 1e-9 * unit) << low << " " << high << " " << taken;
    }
  }
}

// Sums over random rows of four correlated terms, about an origin.
struct Rows {
  Eigen::MatrixXd terms;
  Eigen::VectorXd output;
  Eigen::VectorXd weights;
  llmt::LocalSums sums;
  llmt::Origin origin;
};

Rows random_rows(std::uint64_t seed) {
  llmt::Random random(seed);
  constexpr Eigen::Index count = 60;
  Rows rows{.terms = Eigen::MatrixXd(count, 4),
            .output = Eigen::VectorXd(count),
            .weights = Eigen::VectorXd(count),
            .sums = {},
            .origin = {Eigen::Vector4d(0.5, -2.0, 10.0, 0.0), Eigen::VectorXd::Constant(1, 3.0)}};
  for (Eigen::Index i = 0; i < count; ++i) {
    const double common = random.normal();
    for (Eigen::Index k = 0; k < 4; ++k) rows.terms(i, k) = rows.origin.terms(k) + common + 0.5 * random.normal();
    rows.output(i) = 2.0 + rows.terms(i, 0) - 3.0 * rows.terms(i, 2) + 0.3 * random.normal();
    rows.weights(i) = random.uniform(0.5, 1.5);
  }
  Eigen::MatrixXd a(count, 5);
  a << Eigen::VectorXd::Ones(count), rows.terms.rowwise() - rows.origin.terms.transpose();
  const Eigen::VectorXd y = rows.output.array() - 3.0;
  rows.sums = {a.transpose() * rows.weights.asDiagonal() * a, a.transpose() * rows.weights.asDiagonal() * y,
               Eigen::VectorXd::Constant(1, rows.weights.dot(y.cwiseAbs2()))};
  return rows;
}

double rss(const Rows& rows, const llmt::Equation& equation) {
  Eigen::VectorXd residual = rows.output.array() - equation.intercept(0);
  for (std::size_t t = 0; t < equation.terms.size(); ++t) {
    residual -= equation.slope(0, t) * rows.terms.col(equation.terms[t]);
  }
  return rows.weights.dot(residual.cwiseAbs2());
}

TEST(SelectionPath, ItsSumsOfSquaresAreThoseOfLeastSquares) {
  const Rows rows = random_rows(4);
  const llmt::SelectionPath path = llmt::selection_path(rows.sums, 4);
  ASSERT_EQ(path.regressors.size(), 4u);
  const Eigen::VectorXd root = rows.weights.cwiseSqrt();
  for (Eigen::Index k = 0; k <= 4; ++k) {
    Eigen::MatrixXd a = Eigen::MatrixXd::Ones(rows.terms.rows(), k + 1);
    for (Eigen::Index t = 0; t < k; ++t) a.col(t + 1) = rows.terms.col(path.regressors[t]);
    a = root.asDiagonal() * a;
    const Eigen::VectorXd y = root.cwiseProduct(rows.output);
    EXPECT_NEAR(path.rss(0, k), (y - a * a.colPivHouseholderQr().solve(y)).squaredNorm(), 1e-9 * path.rss(0, 0));
  }
  // Each step takes the best of what is left.
  for (Eigen::Index other = 0; other < 4; ++other) {
    llmt::SelectionPath alone{.regressors = {other}, .rss = {}};
    const llmt::Grains fine{.intercept = {-12}, .slopes = {{-12, -12, -12, -12}}};
    EXPECT_GE(rss(rows, llmt::rounded_equation(rows.sums, alone, 1, rows.origin, fine)), path.rss(0, 1) - 1e-9);
  }
}

TEST(RoundedEquation, WithFineGrainsIsLeastSquares) {
  const Rows rows = random_rows(5);
  const llmt::SelectionPath path = llmt::selection_path(rows.sums, 4);
  const llmt::Grains fine{.intercept = {-12}, .slopes = {{-12, -12, -12, -12}}};
  for (Eigen::Index count = 0; count <= 4; ++count) {
    const llmt::Equation equation = llmt::rounded_equation(rows.sums, path, count, rows.origin, fine);
    EXPECT_NEAR(rss(rows, equation), path.rss(0, count), 1e-8 * path.rss(0, 0));
  }
}

// Rounding one slope after the other leaves at most a quarter of the sum of the squares of grain times the length that
// each column has beyond those before it (Babai 1986); the rounded intercept adds a quarter of weight times its grain
// squared.
TEST(RoundedEquation, CoarseGrainsCostNoMoreThanTheNearestPlaneMay) {
  for (std::uint64_t seed = 6; seed < 30; ++seed) {
    const Rows rows = random_rows(seed);
    const llmt::SelectionPath path = llmt::selection_path(rows.sums, 4);
    const llmt::Grains coarse{.intercept = {-1}, .slopes = {{0, -1, -1, 0}}};
    const llmt::Equation equation = llmt::rounded_equation(rows.sums, path, 4, rows.origin, coarse);
    const double weight = rows.weights.sum();
    double bound = path.rss(0, 4) + 0.25 * weight * 0.01;
    const Eigen::VectorXd root = rows.weights.cwiseSqrt();
    Eigen::MatrixXd before = root;
    for (std::size_t t = 0; t < 4; ++t) {
      const Eigen::VectorXd column = root.cwiseProduct(rows.terms.col(equation.terms[t]));
      const double beyond = (column - before * before.colPivHouseholderQr().solve(column)).squaredNorm();
      const double grain = std::pow(10.0, coarse.slopes[0][equation.terms[t]]);
      bound += 0.25 * grain * grain * beyond;
      EXPECT_EQ(equation.slope(0, t), llmt::rounded(equation.slope(0, t), coarse.slopes[0][equation.terms[t]]));
      before.conservativeResize(Eigen::NoChange, before.cols() + 1);
      before.col(before.cols() - 1) = column;
    }
    EXPECT_LE(rss(rows, equation), bound + 1e-9);
    EXPECT_EQ(equation.intercept(0), llmt::rounded(equation.intercept(0), -1));
  }
}

// Two columns at right angles, with slopes 0.03 and 1: the first, of a grain of 1, would be 0.
TEST(RoundedEquation, ASlopeKeepsOneDigitWhereTheNextTermAsksForIt) {
  const Eigen::Vector3d products(0.0, 3.0, 100.0);
  const llmt::LocalSums sums{100.0 * Eigen::Matrix3d::Identity(), products, Eigen::VectorXd::Constant(1, 101.0)};
  const llmt::SelectionPath path{.regressors = {0, 1}, .rss = {}};
  const llmt::Origin origin{Eigen::Vector2d::Zero(), Eigen::VectorXd::Zero(1)};
  const llmt::Grains grains{.intercept = {0}, .slopes = {{0, 0}}};
  const auto first_slope = [&](const std::vector<llmt::Parents>& parents) {
    return llmt::rounded_equation(sums, path, 2, origin, grains, parents).slope(0, 0);
  };
  EXPECT_EQ(first_slope({}), 0.0);
  EXPECT_EQ(first_slope({{-1, -1}, {-1, -1}}), 0.0);
  EXPECT_EQ(first_slope({{-1, -1}, {0, 0}}), 0.03);
}

}  // namespace
