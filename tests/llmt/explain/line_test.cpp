// Where the line of an explanation is cut, and shares of models that are small enough to do by hand.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "explain/straight_line.hpp"
#include "llmt/explain.hpp"
#include "llmt/fit.hpp"
#include "oracles/oracles.hpp"
#include "oracles/random_models.hpp"
#include "partition/evaluator.hpp"

namespace {

constexpr double no_value = std::numeric_limits<double>::quiet_NaN();

llmt::Node leaf(double value, const Eigen::VectorXd& slope) {
  llmt::Node node;
  node.rss = Eigen::VectorXd::Zero(1);
  node.value = Eigen::VectorXd::Constant(1, value);
  node.slope = slope.transpose();
  node.mean = Eigen::VectorXd::Zero(slope.size());
  node.low = Eigen::VectorXd::Constant(slope.size(), -10.0);
  node.high = Eigen::VectorXd::Constant(slope.size(), 10.0);
  return node;
}

llmt::Node split(int input, double threshold, int left, Eigen::Index inputs) {
  llmt::Node node = leaf(0.0, Eigen::VectorXd::Zero(inputs));
  node.split_input = input;
  node.threshold = threshold;
  node.left = left;
  node.right = left + 1;
  return node;
}

// Numbers whose centre is 0; one output.
llmt::Model model_of(const std::vector<llmt::Node>& nodes, const llmt::Validity& validity = {}) {
  llmt::Partition partition;
  partition.outputs = {0};
  partition.validity = validity;
  partition.nodes = nodes;
  std::vector<llmt::InputColumn> inputs;
  std::vector<llmt::Regressor> regressors;
  for (int j = 0; j < nodes.front().slope.cols(); ++j) {
    inputs.push_back({.name = std::string(1, static_cast<char>('a' + j)), .low = -10.0, .high = 10.0});
    regressors.push_back({.input = j});
  }
  return {inputs, {{.name = "y", .low = -1.0, .high = 1.0}}, regressors, {partition}};
}

// How far the values at the places between Chebyshev's points of from ... to are off the polynomial of degree 47
// through the points.
template <class Values>
double distance_from_polynomial(double from, double to, const Values& values) {
  constexpr int count = 48;
  Eigen::VectorXd at(2 * count - 1);
  for (Eigen::Index k = 0; k < at.size(); ++k) {
    const double cosine = std::cos(std::numbers::pi * (static_cast<double>(k) + 1.0) / (2.0 * count));
    at(k) = 0.5 * (from + to) - 0.5 * (to - from) * cosine;
  }
  const Eigen::MatrixXd found = values(at);  // points in the even places
  double worst = 0.0;
  for (Eigen::Index k = 1; k < at.size(); k += 2) {
    Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(found.cols());
    double weights = 0.0;
    for (Eigen::Index i = 0; i < count; ++i) {
      const double sine = std::sin(std::numbers::pi * (2.0 * static_cast<double>(i) + 1.0) / (2.0 * count));
      const double weight = (i % 2 == 0 ? sine : -sine) / (at(k) - at(2 * i));
      sum += weight * found.row(2 * i);
      weights += weight;
    }
    worst = std::max(worst, (found.row(k) - sum / weights).cwiseAbs().maxCoeff());
  }
  return worst;
}

// The largest distance over all pieces. Inputs that are switched have the point's value from the middle on.
double worst_piece(const llmt::Model& model, const llmt::StraightLine& line, bool at_kinks) {
  const llmt::Partition& partition = model.partitions()[0];
  const llmt::Evaluator evaluator(partition, model.inputs(), std::ssize(model.regressors()));
  const llmt::Pieces pieces = llmt::cut_line(model, partition, evaluator, line, at_kinks);
  EXPECT_EQ(pieces.cuts.back(), 1.0);
  double worst = 0.0;
  double from = 0.0;
  for (const double to : pieces.cuts) {
    const double begin = std::exchange(from, to);
    if (to - begin <= 1e-9) continue;
    Eigen::VectorXd still = line.reference;
    for (const Eigen::Index j : line.switched) {
      if (begin >= 0.5) still(j) = line.point(j);
    }
    const auto values = [&](const Eigen::VectorXd& at) {
      Eigen::MatrixXd rows(at.size(), still.size());
      for (Eigen::Index k = 0; k < at.size(); ++k) rows.row(k) = line.at(at(k), still).transpose();
      return model.predict(rows);
    };
    worst = std::max(worst, distance_from_polynomial(begin, to, values));
  }
  return worst;
}

// Nothing holds the sum of the local models to a range.
llmt::Model unheld(const llmt::Model& model) {
  std::vector<llmt::Partition> partitions = model.partitions();
  for (llmt::Partition& partition : partitions) {
    partition.residual_range.resize(0, 0);
    partition.output_range.resize(0, 0);
  }
  return {model.inputs(), model.outputs(), model.regressors(), partitions};
}

TEST(CutLine, PredictionsOfRandomTreesArePolynomialsBetweenCuts) {
  using random_models::Kind;
  double without_kinks = 0.0;
  constexpr auto blend = llmt::ValidityKind::blend;
  for (const Kind& kind : {Kind{.name = "crisp"}, Kind{.name = "crisp with categories", .inputs = 5, .categories = 2},
                           Kind{.name = "blend", .validity = blend},
                           Kind{.name = "blend with categories", .validity = blend, .inputs = 5, .categories = 2},
                           Kind{.name = "oblique", .inputs = 4, .categories = 1, .oblique = true},
                           Kind{.name = "oblique blend", .validity = blend, .inputs = 4, .oblique = true}}) {
    const llmt::Model model = unheld(random_models::random_model(kind, 3));
    llmt::Random random(4);
    const auto row = [&] {
      Eigen::VectorXd x = 1.8 * oracle::uniform(kind.inputs, 1, random.below(1000000));
      for (int j = 0; j < kind.inputs; ++j) {
        if (j >= kind.inputs - kind.categories) x(j) = static_cast<double>(random.below(5));
        if (random.uniform() < 0.15) x(j) = no_value;
      }
      return x;
    };
    for (int k = 0; k < 20; ++k) {
      const Eigen::VectorXd reference = row();
      const llmt::StraightLine line(model, reference, row());
      EXPECT_LT(worst_piece(model, line, true), 1e-11) << kind.name << ", line " << k;
      without_kinks = std::max(without_kinks, worst_piece(model, line, false));
    }
  }
  EXPECT_GT(without_kinks, 1e-3);
}

// Within the training extent products leave the ranges of nodes.
TEST(CutLine, PredictionsOfQuadraticTreesArePolynomialsBetweenCuts) {
  const Eigen::MatrixXd x = oracle::uniform(300, 2, 5);
  double without_kinks = 0.0;
  for (const llmt::ValidityChoice validity : {llmt::ValidityChoice::crisp, llmt::ValidityChoice::blend}) {
    llmt::FitOptions options;
    options.terms = llmt::LocalTerms::quadratic;
    options.max_leaves = 6;
    options.significance = 1.0;
    options.validity = validity;
    options.expert.widths = {1.0};
    options.folds.count = 0;
    const llmt::Model model = unheld(llmt::fit(x, oracle::curved(x, 0.1, 5), options).model);
    ASSERT_EQ(model.partitions()[0].num_leaves(), 6);
    const Eigen::MatrixXd ends = 0.95 * oracle::uniform(40, 2, 6);
    for (Eigen::Index k = 0; k < 40; k += 2) {
      const llmt::StraightLine line(model, ends.row(k).transpose(), ends.row(k + 1).transpose());
      EXPECT_LT(worst_piece(model, line, true), 1e-10) << k;
      without_kinks = std::max(without_kinks, worst_piece(model, line, false));
    }
  }
  EXPECT_GT(without_kinks, 1e-3);
}

// Beyond the training extent the factors of a product are held.
TEST(CutLine, PredictionsOfAProductArePolynomialsBetweenCuts) {
  llmt::Node node = leaf(0.5, Eigen::Vector3d(0.1, -0.2, 1.0));
  node.low << -0.5, -2.0, -6.0;
  node.high << 1.5, 0.5, 3.0;
  const llmt::Model model({{.name = "a", .low = -1.0, .high = 2.0}, {.name = "b", .low = -3.0, .high = 1.0}},
                          {{.name = "y", .low = -1.0, .high = 1.0}},
                          {{.input = 0}, {.input = 1}, {.input = 0, .second_input = 1}},
                          {{.outputs = {0}, .nodes = {node}}});
  Eigen::MatrixXd ends = oracle::uniform(40, 2, 7);
  ends.topRows(20) *= Eigen::Vector2d(4.0, 0.9).asDiagonal();  // the product stays within its range
  ends.bottomRows(20) *= Eigen::Vector2d(0.8, 4.5).asDiagonal();
  double without_kinks = 0.0;
  for (Eigen::Index k = 0; k < 40; k += 2) {
    const llmt::StraightLine line(model, ends.row(k).transpose(), ends.row(k + 1).transpose());
    EXPECT_LT(worst_piece(model, line, true), 1e-11) << k;
    without_kinks = std::max(without_kinks, worst_piece(model, line, false));
  }
  EXPECT_GT(without_kinks, 1e-3);
}

void expect_shares(const llmt::Model& model, const Eigen::VectorXd& from, const Eigen::VectorXd& to,
                   const Eigen::VectorXd& expected) {
  const llmt::Attribution found = llmt::attribute(model, to, from);
  EXPECT_LT((found.contributions.row(0).transpose() - expected).cwiseAbs().maxCoeff(), 1e-9)
      << found.contributions << " instead of " << expected.transpose();
  EXPECT_NEAR(found.prediction(0), model.predict(to.transpose())(0), 1e-15);
}

// y = 0 for a <= 0, else 1 + b: a has the jump where the line crosses, b the slope from there on.
TEST(LineByHand, ACrispSplitJumpsWhereTheLineCrosses) {
  const llmt::Model model =
      model_of({split(0, 0.0, 1, 2), leaf(0.0, Eigen::Vector2d::Zero()), leaf(1.0, Eigen::Vector2d(0.0, 1.0))});
  for (const double start : {-0.9, -0.5, -0.05, -0.001}) {
    expect_shares(model, Eigen::Vector2d(start, 0.0), Eigen::Vector2d(1.0 + start, 1.0),
                  Eigen::Vector2d(1.0 - start, 1.0 + start));
  }
}

// A twentieth of the way that a goes elsewhere, and at 0.4 of it the split.
TEST(LineByHand, AShortWayCrossesToo) {
  const llmt::Model model =
      model_of({split(0, 0.0, 1, 2), leaf(0.0, Eigen::Vector2d::Zero()), leaf(1.0, Eigen::Vector2d(0.0, 1.0))});
  expect_shares(model, Eigen::Vector2d(-0.02, 0.0), Eigen::Vector2d(0.03, 1.0), Eigen::Vector2d(1.4, 0.6));
  expect_shares(model, Eigen::Vector2d(0.03, 1.0), Eigen::Vector2d(-0.02, 0.0), Eigen::Vector2d(-1.4, -0.6));
}

// A threshold 1e-13 before the end counts as there, and all other inputs have reached the point.
TEST(LineByHand, AThresholdNextToTheEndLeavesNothingBeyond) {
  const llmt::Model model =
      model_of({split(0, 0.0, 1, 2), leaf(0.0, Eigen::Vector2d(0.0, 1.0)), leaf(3.0, Eigen::Vector2d(0.0, 1.0))});
  expect_shares(model, Eigen::Vector2d(-1.0, 0.0), Eigen::Vector2d(1e-13, 1.0), Eigen::Vector2d(3.0, 1.0));
}

// The jump of an oblique split is shared out by what the inputs move, on long lines and on short ones.
TEST(LineByHand, AnObliqueSplitSharesItsJump) {
  llmt::Node root = split(0, 0.2, 1, 3);
  root.direction = Eigen::Vector3d(1.0, 1.0, 0.0);
  const llmt::Model jumps = model_of({root, leaf(0.0, Eigen::Vector3d::Zero()), leaf(3.0, Eigen::Vector3d::Zero())});
  for (const double length : {1.0, 0.1, 1e-3}) {
    const Eigen::Vector3d way = length * Eigen::Vector3d(2.0, 1.0, 0.3);
    const Eigen::Vector3d from = Eigen::Vector3d(0.15, 0.05, 0.0) - 0.4 * way;
    expect_shares(jumps, from, from + way, Eigen::Vector3d(2.0, 1.0, 0.0));
    expect_shares(jumps, from + way, from, Eigen::Vector3d(-2.0, -1.0, 0.0));
  }
  // All inputs are 0 at the threshold, so that no step of theirs is a part of what they are.
  root.threshold = 0.0;
  const llmt::Model at_zero = model_of({root, leaf(0.0, Eigen::Vector3d::Zero()), leaf(3.0, Eigen::Vector3d::Zero())});
  expect_shares(at_zero, Eigen::Vector3d(-2.0, -1.0, 0.0), Eigen::Vector3d(2.0, 1.0, 0.0),
                Eigen::Vector3d(2.0, 1.0, 0.0));
  root.threshold = 0.2;
  // b is missing on the first half, and counts as 0. On the second half it is 0.1: a crosses at 0.1, where c is 0.55.
  const llmt::Model sloped =
      model_of({root, leaf(0.0, Eigen::Vector3d::Zero()), leaf(1.0, Eigen::Vector3d(0.0, 0.0, 1.0))});
  expect_shares(sloped, Eigen::Vector3d(-1.0, no_value, 0.0), Eigen::Vector3d(1.0, 0.1, 1.0),
                Eigen::Vector3d(1.55, 0.0, 0.45));
}

// y = w(a) - w(b): what the two inputs do cancels all along the line from (0, 0) to (1, 1).
llmt::Model difference_of_gates(const llmt::Validity& validity, double half_width) {
  std::vector<llmt::Node> nodes = {split(0, 0.5, 1, 2), split(1, 0.5, 3, 2), split(1, 0.5, 5, 2)};
  for (const double value : {0.0, -1.0, 1.0, 0.0}) nodes.push_back(leaf(value, Eigen::Vector2d::Zero()));
  for (int k = 0; k < 3; ++k) nodes[k].half_width = half_width;
  return model_of(nodes, validity);
}

TEST(LineByHand, SharesThatCancelAreSeen) {
  const llmt::Model blend = difference_of_gates({llmt::ValidityKind::blend, 1.0}, 0.1);
  expect_shares(blend, Eigen::Vector2d::Zero(), Eigen::Vector2d::Ones(), Eigen::Vector2d(1.0, -1.0));
  for (const double half_width : {0.1, 0.01, 0.001}) {
    const llmt::Model gates = difference_of_gates({llmt::ValidityKind::logistic, 1.0}, half_width);
    const double rise = std::tanh(0.25 / half_width);  // 1 / (1 + exp(-u)) - 1 / (1 + exp(u)), u = 0.5 / half_width
    expect_shares(gates, Eigen::Vector2d::Zero(), Eigen::Vector2d::Ones(), Eigen::Vector2d(rise, -rise));
  }
  // On a grid of boxes normalised Gaussians are products of a factor for each input.
  for (const double width : {0.04, 0.1}) {
    const llmt::Model gaussians = difference_of_gates({llmt::ValidityKind::gaussian, width}, 0.0);
    const double rise = gaussians.predict(Eigen::RowVector2d(1.0, 0.0))(0);
    EXPECT_GT(rise, 0.9);
    expect_shares(gaussians, Eigen::Vector2d::Zero(), Eigen::Vector2d::Ones(), Eigen::Vector2d(rise, -rise));
  }
}

// Importance looks at eight pieces of the line, not at its kinks.
TEST(LineByHand, ImportanceSeesWhatCancels) {
  const llmt::Model blend = difference_of_gates({llmt::ValidityKind::blend, 1.0}, 0.1);
  const Eigen::MatrixXd importance = llmt::importance(blend, Eigen::RowVector2d(1.0, 1.0));
  EXPECT_NEAR(importance(0, 0), 0.5, 1e-12);
  EXPECT_NEAR(importance(0, 1), 0.5, 1e-12);
}

}  // namespace
