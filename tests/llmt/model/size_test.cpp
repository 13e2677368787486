// The size of expressions that are written out beside each model, and counted by hand.
#include "llmt/size.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

namespace {

using llmt::ValidityKind;

// Two numbers x0 and x1 with the centres 0 and 2, and a category with the levels a, b, c.
const std::vector<llmt::InputColumn> inputs = {
    {.name = "x0", .low = -9.0, .high = 9.0},
    {.name = "x1", .low = -9.0, .high = 9.0, .centre = 2.0},
    {.name = "kind", .low = 0.0, .high = 2.0, .centre = 1.0, .levels = {"a", "b", "c"}}};

llmt::Node node(const std::vector<double>& slope, Eigen::Index outputs = 1) {
  const Eigen::Index regressors = std::ssize(slope);
  llmt::Node made;
  made.rss = Eigen::VectorXd::Zero(outputs);
  made.value = Eigen::VectorXd::Constant(outputs, 0.5);
  made.slope = Eigen::Map<const Eigen::RowVectorXd>(slope.data(), regressors).replicate(outputs, 1);
  made.mean = made.low = made.high = Eigen::VectorXd::Zero(regressors);
  return made;
}

// A split of the root of three nodes, or of five, whose second split is like the first one.
void split(llmt::Partition& partition, int at, const llmt::Node& like) {
  llmt::Node& made = partition.nodes[at];
  made.left = 2 * at + 1;
  made.right = 2 * at + 2;
  made.split_input = like.split_input;
  made.threshold = like.threshold;
  made.direction = like.direction;
  made.level_side = like.level_side;
  made.half_width = like.half_width;
}

llmt::Model model(const llmt::Partition& partition, const std::vector<llmt::Regressor>& regressors = {{.input = 0}}) {
  std::vector<llmt::OutputColumn> outputs;
  for (const int output : partition.outputs) {
    outputs.push_back({.name = "y" + std::to_string(output), .low = -99.0, .high = 99.0});
  }
  return {inputs, outputs, regressors, {partition}};
}

llmt::Model one_leaf(const std::vector<llmt::Regressor>& regressors, const std::vector<double>& slope) {
  return model({.outputs = {0}, .nodes = {node(slope)}}, regressors);
}

// Leaves 0.5 and 0.5 + 1 * x0, of sizes 1 and 5, and `like` at the root.
llmt::Model two_leaves(const llmt::Node& like, ValidityKind kind = ValidityKind::crisp, int smoothness = 1) {
  llmt::Partition partition{
      .outputs = {0}, .validity = {kind, 1.0, smoothness}, .nodes = {node({0.0}), node({0.0}), node({1.0})}};
  split(partition, 0, like);
  return model(partition);
}

llmt::Node on_number(double half_width = 0.0) {
  llmt::Node like;
  like.split_input = 1;
  like.threshold = 3.0;
  like.half_width = half_width;
  return like;
}

llmt::Node oblique(double half_width = 0.0) {
  llmt::Node like = on_number(half_width);
  like.direction = Eigen::Vector3d(1.0, -2.0, 0.0);
  return like;
}

TEST(ExpressionSize, CountsTheTermsOfALocalModel) {
  const std::vector<llmt::Regressor> linear = {{.input = 0}, {.input = 1}};
  EXPECT_EQ(llmt::expression_size(one_leaf(linear, {0.0, 0.0})), 1);                 // 0.5
  EXPECT_EQ(llmt::expression_size(one_leaf(linear, {0.0, 2.0})), 5);                 // c + 2 * x1
  EXPECT_EQ(llmt::expression_size(one_leaf(linear, {1.0, 2.0})), 9);                 // c + 1 * x0 + 2 * x1
  EXPECT_EQ(llmt::expression_size(one_leaf({{.input = 2, .level = 1}}, {1.0})), 7);  // c + 1 * (kind = b)
  // c + 1 * x0 * (x1 - 2), c + 1 * x0 ^ 2, c + 1 * (x1 - 2) ^ 2
  EXPECT_EQ(llmt::expression_size(one_leaf({{.input = 0, .second_input = 1}}, {1.0})), 9);
  EXPECT_EQ(llmt::expression_size(one_leaf({{.input = 0, .second_input = 0}}, {1.0})), 7);
  EXPECT_EQ(llmt::expression_size(one_leaf({{.input = 1, .second_input = 1}}, {1.0})), 9);
}

TEST(ExpressionSize, OfAJumpIsAComparisonMore) {
  EXPECT_EQ(llmt::expression_size(two_leaves(on_number())), 6 + 4);  // if(x1 <= 3, L, R)
  EXPECT_EQ(llmt::expression_size(two_leaves(oblique())), 6 + 10);   // if(1 * x0 + -2 * x1 <= c, L, R)
  llmt::Node like = on_number();
  like.threshold = std::numeric_limits<double>::max();
  EXPECT_EQ(llmt::expression_size(two_leaves(like)), 6 + 3);  // if(x1 is missing, R, L)
  like = on_number();
  like.split_input = 2;
  like.level_side = {-1, 1, -1};
  EXPECT_EQ(llmt::expression_size(two_leaves(like)), 6 + 5);  // if(kind in {a, c}, L, R)
}

TEST(ExpressionSize, OfATransitionIsThatOfItsEquation) {
  // (1 - v^2 * (3 - 2 * v)) * L + v^2 * (3 - 2 * v) * R: 19 and four times v = min(1, max(0, (x1 - a) / b)): 9
  EXPECT_EQ(llmt::expression_size(two_leaves(on_number(1.0), ValidityKind::blend)), 6 + 19 + 4 * 9);
  // (1 - v^3 * (10 - v * (15 - 6 * v))) * L + v^3 * (10 - v * (15 - 6 * v)) * R: 25 and six times v
  EXPECT_EQ(llmt::expression_size(two_leaves(on_number(1.0), ValidityKind::blend, 2)), 6 + 25 + 6 * 9);
  EXPECT_EQ(llmt::expression_size(two_leaves(on_number(), ValidityKind::blend)), 6 + 4);  // jumps
  // 1 / (1 + exp((s - c) / h)) * L + (1 - 1 / (1 + exp((s - c) / h))) * R: 23 and twice s, x1 or 1 * x0 + -2 * x1
  EXPECT_EQ(llmt::expression_size(two_leaves(on_number(1.0), ValidityKind::logistic)), 6 + 23 + 2 * 1);
  EXPECT_EQ(llmt::expression_size(two_leaves(oblique(1.0), ValidityKind::logistic)), 6 + 23 + 2 * 7);
}

TEST(ExpressionSize, OfGaussiansIsTheQuotientOfTwoSums) {
  // (m1 * L + m2 * R) / (m1 + m2): 5 and four times m = exp(-0.5 * ((x1 - c) / s) ^ 2): 10
  EXPECT_EQ(llmt::expression_size(two_leaves(on_number(), ValidityKind::gaussian)), 6 + 5 + 4 * 10);
  llmt::Partition partition{.outputs = {0},
                            .validity = {ValidityKind::gaussian, 1.0, 1},
                            .nodes = {node({0.0}), node({0.0}), node({0.0}), node({1.0}), node({1.0})}};
  split(partition, 0, on_number());
  llmt::Node second = on_number();
  second.split_input = 0;
  split(partition, 1, second);
  // (m1 * A + m2 * B + m3 * C) / (m1 + m2 + m3): 8 and six times m = exp(-0.5 * (((x0 - c) / s)^2 + ((x1 - c) / s)^2))
  EXPECT_EQ(llmt::expression_size(model(partition)), 1 + 5 + 5 + 8 + 6 * 18);
}

TEST(ExpressionSize, AddsUpOverSplitsAndOutputs) {
  // Two outputs of one partition: if(x1 <= 3, if(x1 <= 3, A, B), C) with B = C = 0.5 + 1 * x0 and A = 0.5.
  llmt::Partition partition{.outputs = {0, 1},
                            .nodes = {node({1.0}, 2), node({1.0}, 2), node({1.0}, 2), node({0.0}, 2), node({1.0}, 2)}};
  split(partition, 0, on_number());
  split(partition, 1, on_number());
  EXPECT_EQ(llmt::expression_size(model(partition)), 2 * (4 + 4 + 1 + 5 + 5));
}

}  // namespace
