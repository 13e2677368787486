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

namespace {

using llmt::ValidityKind;

constexpr double missing = std::numeric_limits<double>::quiet_NaN();

struct Kind {
  std::string name;
  ValidityKind validity = ValidityKind::crisp;
  int smoothness = 1;
  int inputs = 3;
  int categories = 0;  // inputs with levels, behind the numbers
  int outputs = 1;
  bool shared = false;  // one partition for all outputs
  int leaves = 20;
  bool oblique = false;  // splits on numbers
};

Eigen::VectorXd normal(Eigen::Index size, llmt::Random& random) {
  Eigen::VectorXd values(size);
  for (double& value : values) {
    value = random.normal();
  }
  return values;
}

// Its ranges are cut out of low ... high.
llmt::Node local_model(Eigen::Index outputs, const Eigen::VectorXd& low, const Eigen::VectorXd& high,
                       llmt::Random& random) {
  const Eigen::Index regressors = low.size();
  llmt::Node node;
  node.samples = 100;
  node.rank = static_cast<int>(regressors) + 1;
  node.rss = normal(outputs, random).cwiseAbs();
  node.value = normal(outputs, random);
  node.slope = normal(outputs * regressors, random).reshaped(outputs, regressors);
  node.mean = 0.1 * normal(regressors, random);
  const auto part = [&](double bound) { return bound * random.uniform(0.8, 1.05); };
  node.low = low.unaryExpr(part).cwiseMax(low);
  node.high = high.unaryExpr(part).cwiseMin(high);
  const Eigen::MatrixXd factor =
      normal((regressors + 1) * (regressors + 1), random).reshaped(regressors + 1, regressors + 1);
  node.inverse_gram = factor * factor.transpose();
  return node;
}

llmt::Partition random_partition(const Kind& kind, std::vector<int> outputs,
                                 const std::vector<llmt::InputColumn>& inputs, Eigen::Index regressors,
                                 llmt::Random& random) {
  const Eigen::Index served = std::ssize(outputs);
  llmt::Partition partition{
      .outputs = std::move(outputs),
      .validity = {kind.validity, kind.validity == ValidityKind::gaussian ? 0.4 : 1.0, kind.smoothness},
      .nodes = {}};
  const Eigen::VectorXd reach = Eigen::VectorXd::Constant(regressors, 1.2);
  partition.nodes = {local_model(served, -reach, reach, random)};
  std::vector<Eigen::VectorXd> low = {Eigen::VectorXd::Constant(kind.inputs, -1.0)};
  std::vector<Eigen::VectorXd> high = {Eigen::VectorXd::Constant(kind.inputs, 1.0)};
  while (partition.num_leaves() < kind.leaves) {
    std::size_t index = 0;
    do {
      index = static_cast<std::size_t>(random.uniform() * static_cast<double>(partition.nodes.size()));
    } while (!partition.nodes[index].is_leaf());
    const int count = static_cast<int>(partition.nodes.size());
    low.insert(low.end(), 2, Eigen::VectorXd(low[index]));
    high.insert(high.end(), 2, Eigen::VectorXd(high[index]));
    llmt::Node& node = partition.nodes[index];
    node.left = count;
    node.right = count + 1;
    node.split_input = static_cast<int>(random.uniform() * static_cast<double>(inputs.size()));
    node.missing_left = random.uniform() < 0.3 ? 1.0 : random.uniform();
    const llmt::InputColumn& input = inputs[node.split_input];
    if (input.is_categorical()) {
      for (std::size_t level = 0; level < input.levels.size(); ++level) {
        node.level_side.push_back(static_cast<int>(random.uniform() * 3.0) - 1);
      }
    } else {
      const double from = low[index](node.split_input);
      const double to = high[index](node.split_input);
      node.threshold = from + random.uniform(0.2, 0.8) * (to - from);
      high[count](node.split_input) = node.threshold;
      low[count + 1](node.split_input) = node.threshold;
      if (kind.validity == ValidityKind::blend && random.uniform() < 0.9) {
        node.half_width = std::min(node.threshold - from, to - node.threshold);
      }
      if (kind.validity == ValidityKind::logistic && random.uniform() < 0.9) {
        node.half_width = random.uniform() < 0.2 ? 0.001 : 0.2;
      }
      if (kind.oblique) {
        node.direction = Eigen::VectorXd::Zero(kind.inputs);
        for (int j = 0; j < kind.inputs - kind.categories; ++j) {
          node.direction(j) = random.uniform() < 0.8 ? random.normal() : 0.0;
        }
        node.direction(node.split_input) += 1.5;
        node.threshold = random.uniform(-0.5, 0.5);
      }
    }
    for (int child = 0; child < 2; ++child) {
      const llmt::Node& parent = partition.nodes[index];
      partition.nodes.push_back(local_model(served, parent.low, parent.high, random));
    }
  }
  partition.outer_slope = 0.5 * partition.nodes.front().slope;
  partition.residual_range.resize(served, 2);
  partition.residual_range << Eigen::VectorXd::Constant(served, -3.0), Eigen::VectorXd::Constant(served, 2.5);
  return partition;
}

llmt::Model random_model(const Kind& kind, std::uint64_t seed) {
  llmt::Random random(seed);
  std::vector<llmt::InputColumn> inputs;
  std::vector<llmt::Regressor> regressors;
  for (int j = 0; j < kind.inputs; ++j) {
    inputs.push_back({.name = std::to_string(j), .low = -1.0, .high = 1.0, .centre = kind.oblique ? 0.1 : 0.0});
    if (j < kind.inputs - kind.categories) {
      regressors.push_back({.input = j, .level = -1, .centre = 0.1 * random.normal()});
      continue;
    }
    inputs.back().levels = {"a", "b", "c", "d"};
    for (const int level : {0, 2}) {
      regressors.push_back({.input = j, .level = level, .centre = 0.25});
    }
  }
  std::vector<llmt::OutputColumn> outputs;
  std::vector<int> all;
  for (int o = 0; o < kind.outputs; ++o) {
    outputs.push_back({.name = std::to_string(o), .low = -1.0, .high = 1.0});
    all.push_back(o);
  }
  std::vector<llmt::Partition> partitions;
  if (kind.shared) {
    partitions.push_back(random_partition(kind, all, inputs, std::ssize(regressors), random));
  } else {
    for (const int o : all) {
      partitions.push_back(random_partition(kind, {o}, inputs, std::ssize(regressors), random));
    }
  }
  return {inputs, outputs, regressors, partitions};
}

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

void PrintTo(const Kind& kind, std::ostream* out) { *out << kind.name; }

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
  const llmt::Model model(held.inputs(), held.outputs(), held.regressors(), {partition});
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
