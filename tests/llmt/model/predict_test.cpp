// Prediction of models that are put together at random, against the equations.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <ostream>
#include <string>

#include "llmt/model.hpp"
#include "oracles/oracles.hpp"
#include "oracles/predict_oracle.hpp"
#include "oracles/random_models.hpp"
#include "oracles/samples.hpp"

namespace {

using oracle::missing;

using llmt::ValidityKind;
using random_models::Kind;
using random_models::random_model;

// Rows inside, outside and on thresholds; with and without missing values and levels that nobody knows.
Eigen::MatrixXd queries(const Kind& kind, const llmt::Model& model, Eigen::Index rows, std::uint64_t seed) {
  llmt::Random random(seed);
  Eigen::MatrixXd x(rows, kind.inputs);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double reach = i % 3 == 0 ? 2.0 : 0.9;
    for (Eigen::Index j = 0; j < kind.inputs; ++j) {
      x(i, j) =
          j < kind.inputs - kind.categories ? random.uniform(-reach, reach) : std::floor(random.uniform(0.0, 4.2));
      if (i % 5 == 0 && random.uniform() < 0.3) {
        x(i, j) = missing;
      }
    }
    const std::vector<llmt::Node>& nodes = model.partitions()[0].nodes;
    const llmt::Node& node = nodes[i % nodes.size()];
    if (i % 7 == 0 && !node.is_leaf() && node.level_side.empty()) {
      x(i, node.split_input) = node.threshold;
    }
  }
  return x;
}

bool same_bytes(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return a.rows() == b.rows() && a.cols() == b.cols() &&
         std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

// As LocalModels documents it.
double sum_in_quads(double value, const Eigen::MatrixXd& slope, const Eigen::VectorXd& deviations) {
  double partial[4] = {};
  for (Eigen::Index k = 0; k < deviations.size(); ++k) {
    partial[k % 4] += slope(0, k) * deviations(k);
  }
  return value + ((partial[0] + partial[2]) + (partial[1] + partial[3]));
}

double blended(const llmt::Partition& partition, int index, double validity, const Eigen::VectorXd& row,
               const Eigen::VectorXd& deviations, double sum) {
  const llmt::Node& node = partition.nodes[index];
  if (node.is_leaf()) return sum + validity * sum_in_quads(node.value(0), node.slope, deviations);
  const double x = row(node.split_input);
  double left = x <= node.threshold ? 1.0 : 0.0;
  if (node.half_width > 0.0) {
    const double v = 0.5 * (std::clamp((x - node.threshold) * (1.0 / node.half_width), -1.0, 1.0) + 1.0);
    left = std::clamp(1.0 - v * v * v * (10.0 - v * (15.0 - 6.0 * v)), 0.0, 1.0);
  }
  sum = left > 0.0 ? blended(partition, node.left, validity * left, row, deviations, sum) : sum;
  return left < 1.0 ? blended(partition, node.right, validity * (1.0 - left), row, deviations, sum) : sum;
}

// Plain code of one number at a time, so the instruction set of the machine is not in the result.
TEST(PredictionInQuads, IsTheSameBytesAsOneNumberAtATime) {
  const Kind kind{.name = "", .validity = ValidityKind::blend, .smoothness = 2, .inputs = 13, .leaves = 50};
  const llmt::Model held = random_model(kind, 21);
  llmt::Partition partition = held.partitions()[0];
  for (llmt::Node& node : partition.nodes) {
    node.low.setConstant(-10.0);
    node.high.setConstant(10.0);
  }
  partition.residual_range = {};
  std::vector<llmt::InputColumn> inputs = held.inputs();
  for (llmt::InputColumn& input : inputs) {
    input.low = -12.0;
    input.high = 12.0;
  }
  const llmt::Model model(inputs, held.outputs(), held.regressors(), {partition});
  const Eigen::MatrixXd x = oracle::uniform(5000, kind.inputs, 22);
  Eigen::VectorXd expected(x.rows());
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    const Eigen::VectorXd row = x.row(i).transpose();
    expected(i) = blended(partition, 0, 1.0, row, oracle::deviations(model, row), 0.0);
  }
  EXPECT_TRUE(same_bytes(model.predict(x), expected));
}

class Prediction : public testing::TestWithParam<Kind> {};

TEST_P(Prediction, IsWhatTheEquationsSay) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const llmt::Model model = random_model(GetParam(), seed);
    const Eigen::MatrixXd x = queries(GetParam(), model, 1500, seed + 100);
    const Eigen::MatrixXd found = model.predict(x, 1);
    const Eigen::MatrixXd expected = oracle::predict_rows(model, x);
    // Sums of a few dozen terms of size one, and quotients by half widths.
    EXPECT_LT(((found - expected).array().abs() / (1.0 + expected.array().abs())).maxCoeff(), 1e-12);
  }
}

TEST_P(Prediction, OfARowDoesNotDependOnTheOthers) {
  const llmt::Model model = random_model(GetParam(), 7);
  const Eigen::Index rows = 9001;
  const Eigen::MatrixXd x = queries(GetParam(), model, rows, 8);
  const Eigen::MatrixXd together = model.predict(x, 1);
  for (const int threads : {0, 2, 3}) {
    EXPECT_TRUE(same_bytes(model.predict(x, threads), together)) << threads;
  }
  for (Eigen::Index i = 0; i < rows; i += 7) {
    ASSERT_TRUE(same_bytes(model.predict(x.row(i)), together.row(i))) << i;
  }
  for (const Eigen::Index size : {2, 8, 15, 16, 17, 33, 1000}) {
    for (Eigen::Index begin = 0; begin + size <= rows; begin += 1300) {
      ASSERT_TRUE(same_bytes(model.predict(x.middleRows(begin, size)), together.middleRows(begin, size))) << size;
    }
  }
  std::vector<int> order(rows);
  std::iota(order.begin(), order.end(), 0);
  llmt::Random random(9);
  for (std::size_t i = order.size() - 1; i > 0; --i) {
    std::swap(order[i], order[static_cast<std::size_t>(random.uniform() * static_cast<double>(i + 1))]);
  }
  EXPECT_TRUE(same_bytes(model.predict(x(order, Eigen::all)), together(order, Eigen::all)));
}

TEST_P(Prediction, ValiditiesAndWhatFollowsFromThem) {
  const llmt::Model model = random_model(GetParam(), 11);
  const Eigen::MatrixXd x = queries(GetParam(), model, 700, 12);
  const Eigen::MatrixXi leaf_of = model.leaf_of(x);
  const std::vector<llmt::Extrapolation> extrapolation = model.extrapolation(x);
  const Eigen::MatrixXd standard_errors = model.standard_errors(x);
  Eigen::VectorXd leverage = Eigen::VectorXd::Zero(x.rows());
  for (Eigen::Index p = 0; p < std::ssize(model.partitions()); ++p) {
    const llmt::Partition& partition = model.partitions()[p];
    const std::vector<llmt::Leaf> leaves = model.leaves(p);
    const Eigen::MatrixXd found = model.validities(x, p);
    double rank = 0.0;
    Eigen::VectorXd rss = Eigen::VectorXd::Zero(std::ssize(partition.outputs));
    for (const llmt::Leaf& leaf : leaves) {
      rank += leaf.rank;
      rss += partition.nodes[leaf.node].rss;
    }
    const Eigen::VectorXd pooled = rss / std::max(1.0, 100.0 - rank);
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      const std::vector<double> expected = oracle::validities(model, partition, x.row(i).transpose());
      double largest = 0.0;
      double of_row = 0.0;
      Eigen::VectorXd variance = Eigen::VectorXd::Zero(std::ssize(partition.outputs));
      for (std::size_t k = 0; k < leaves.size(); ++k) {
        const llmt::Node& node = partition.nodes[leaves[k].node];
        const double validity = expected[leaves[k].node];
        ASSERT_NEAR(found(i, k), validity, 1e-13);
        largest = std::max(largest, validity);
        Eigen::VectorXd a(node.mean.size() + 1);
        a << 1.0, oracle::deviations(model, x.row(i).transpose());
        a.tail(node.mean.size()) = a.tail(node.mean.size()).array().isNaN().select(node.mean, a.tail(node.mean.size()));
        const double quadratic = a.dot(node.inverse_gram * a);
        of_row += validity * quadratic;
        variance += validity * quadratic * (node.rss + 10.0 * pooled) / (std::max(0.0, 100.0 - node.rank) + 10.0);
      }
      EXPECT_NEAR(expected[leaves[leaf_of(i, p)].node], largest, 1e-13);
      leverage(i) = std::max(leverage(i), of_row);
      for (std::size_t o = 0; o < partition.outputs.size(); ++o) {
        const double expected_error = std::sqrt(variance(o));
        EXPECT_NEAR(standard_errors(i, partition.outputs[o]) / expected_error, 1.0, 1e-11);
      }
    }
  }
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    EXPECT_NEAR(extrapolation[i].leverage / leverage(i), 1.0, 1e-11);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Models, Prediction,
    testing::Values(Kind{.name = "Crisp"}, Kind{.name = "CrispWide", .inputs = 13, .outputs = 2, .leaves = 60},
                    Kind{.name = "CrispCategories", .inputs = 5, .categories = 2},
                    Kind{.name = "CrispOneInput", .inputs = 1, .leaves = 9}, Kind{.name = "OneLeaf", .leaves = 1},
                    Kind{.name = "CrispManyInputs", .inputs = 70, .leaves = 5},
                    Kind{.name = "C1", .validity = ValidityKind::blend},
                    Kind{.name = "C2", .validity = ValidityKind::blend, .smoothness = 2, .inputs = 8, .leaves = 50},
                    Kind{.name = "BlendShared",
                         .validity = ValidityKind::blend,
                         .smoothness = 2,
                         .inputs = 6,
                         .categories = 2,
                         .outputs = 10,
                         .shared = true},
                    Kind{.name = "BlendApart", .validity = ValidityKind::blend, .categories = 1, .outputs = 3},
                    Kind{.name = "Gaussian", .validity = ValidityKind::gaussian, .inputs = 4, .outputs = 2},
                    Kind{.name = "Logistic", .validity = ValidityKind::logistic, .inputs = 4, .outputs = 2},
                    Kind{.name = "CrispClamped", .inputs = 6, .outputs = 2, .clamped = true},
                    Kind{.name = "BlendClamped",
                         .validity = ValidityKind::blend,
                         .categories = 1,
                         .outputs = 4,
                         .shared = true,
                         .clamped = true},
                    Kind{.name = "GaussianClamped", .validity = ValidityKind::gaussian, .clamped = true},
                    Kind{.name = "ObliqueCrisp", .inputs = 4, .categories = 1, .oblique = true},
                    Kind{.name = "ObliqueBlend", .validity = ValidityKind::blend, .inputs = 4, .oblique = true},
                    Kind{.name = "ObliqueLogistic",
                         .validity = ValidityKind::logistic,
                         .inputs = 6,
                         .categories = 2,
                         .outputs = 2,
                         .shared = true,
                         .oblique = true}),
    [](const auto& param) { return param.param.name; });

}  // namespace
