// What streams are made of: sums, the search for splits, thresholds that move, the reservoir, the correction of blends.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "llmt/fit.hpp"
#include "oracles/oracles.hpp"
#include "oracles/stream_data.hpp"
#include "partition/tree.hpp"
#include "stream/blend_correction.hpp"
#include "stream/detectors.hpp"
#include "stream/reservoir.hpp"
#include "stream/search.hpp"
#include "stream/sums.hpp"
#include "stream/tree.hpp"

namespace {

using llmt::GramShape;
using namespace stream_data;

llmt::StreamSetting setting_for(Eigen::Index inputs) {
  return {.min_leaf_samples = 2 * (inputs + 1),
          .max_leaves = 100,
          .inputs = inputs,
          .shape = GramShape(inputs + 1, 1),
          .output_variance = 1.0,
          .rounding = 1e-10,
          .centre = Eigen::VectorXd::Zero(inputs),
          .scale = Eigen::VectorXd::Ones(inputs)};
}

llmt::Basis origin_basis(Eigen::Index inputs) {
  return {Eigen::VectorXd::Zero(inputs), Eigen::VectorXd::Zero(inputs + 1)};
}

std::vector<double> sums_of(const GramShape& shape, const llmt::Basis& basis, const Eigen::MatrixXd& x,
                            const Eigen::MatrixXd& y, const Eigen::VectorXd& weights) {
  llmt::RowProducts products(shape);
  std::vector<double> gram(shape.size(), 0.0);
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    const Eigen::VectorXd row = x.row(i).transpose();
    products.set(basis, row.data(), y(i, 0), weights(i));
    products.add_to(gram.data());
  }
  return gram;
}

TEST(StreamSums, SolveIsWeightedRidgeAboutTheBase) {
  const Eigen::MatrixXd x = oracle::uniform(60, 3, 1);
  const Eigen::MatrixXd y = oracle::curved(x);
  const Eigen::VectorXd weights = (oracle::uniform(60, 1, 2).array() + 1.5).matrix();
  const GramShape shape(4, 1);
  const llmt::Basis basis{Eigen::Vector3d(0.1, -0.2, 0.3), Eigen::Vector4d(1.0, 0.5, -0.5, 2.0)};
  const std::vector<double> gram = sums_of(shape, basis, x, y, weights);
  const Eigen::MatrixXd a = with_one(x.rowwise() - basis.origin.transpose());
  for (const double shrinkage : {0.0, 5.0}) {
    int rank = 0;
    const Eigen::VectorXd model = basis.base + llmt::solve(shape, gram.data(), shrinkage, rank);
    EXPECT_EQ(rank, 4);
    // `shrinkage` rows of each regressor's variance say that the base holds.
    Eigen::MatrixXd normal = a.transpose() * weights.asDiagonal() * a;
    Eigen::VectorXd right = a.transpose() * weights.asDiagonal() * y;
    for (int k = 1; k < 4; ++k) {
      const double mean = weights.dot(a.col(k)) / weights.sum();
      const double variance = weights.dot((a.col(k).array() - mean).square().matrix()) / weights.sum();
      normal(k, k) += shrinkage * variance;
      right(k) += shrinkage * variance * basis.base(k);
    }
    EXPECT_LT((model - normal.colPivHouseholderQr().solve(right)).norm(), 1e-10) << shrinkage;
  }
}

TEST(StreamSums, CollinearAndConstantColumnsChangeNothing) {
  Eigen::MatrixXd x = oracle::uniform(50, 4, 1);
  x.col(2) = 2.0 * x.col(0) - x.col(1);
  x.col(3).setConstant(0.7);
  const GramShape shape(5, 1);
  const std::vector<double> gram = sums_of(shape, origin_basis(4), x, affine(x), Eigen::VectorXd::Ones(50));
  int rank = 0;
  const Eigen::VectorXd model = llmt::solve(shape, gram.data(), 0.0, rank);
  EXPECT_EQ(rank, 3);
  EXPECT_EQ(model(3), 0.0);
  EXPECT_EQ(model(4), 0.0);
  EXPECT_LT((with_one(x) * model - affine(x)).norm(), 1e-9);
}

TEST(StreamSums, RebaseIsSummingInTheOtherBasis) {
  const Eigen::MatrixXd x = oracle::uniform(40, 3, 3);
  const Eigen::MatrixXd y = oracle::curved(x);
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(40);
  const GramShape shape(4, 1);
  const llmt::Basis from{Eigen::Vector3d(0.1, 0.0, -0.1), Eigen::Vector4d(0.3, 1.0, 0.0, -1.0)};
  const Eigen::Vector3d shift(0.4, -0.3, 0.2);
  const Eigen::Vector4d change(0.2, -0.1, 0.6, 0.5);
  const llmt::Basis to{from.origin + shift, llmt::shifted_model(from.base + change, shift)};
  std::vector<double> gram = sums_of(shape, from, x, y, ones);
  llmt::rebase(shape, shift, change, gram);
  EXPECT_LT(
      (llmt::matrix_of(shape, gram.data()) - llmt::matrix_of(shape, sums_of(shape, to, x, y, ones).data())).norm(),
      1e-11);
}

TEST(StreamSearch, EveryEdgeLeavesWhatBruteForceRefitsLeave) {
  Eigen::MatrixXd x = oracle::uniform(300, 3, 5);
  x.col(1) = (4.0 * x.col(1)).array().round();  // ties
  x(17, 0) = x(200, 2) = std::numeric_limits<double>::quiet_NaN();
  const Eigen::MatrixXd known = x.array().isNaN().select(0.0, x);
  const Eigen::MatrixXd y = oracle::curved(known, 0.1);
  const llmt::StreamSetting setting = setting_for(3);
  llmt::LeafSearch search(setting);
  const llmt::Basis basis = origin_basis(3);
  llmt::RowProducts products(setting.shape);
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    const Eigen::VectorXd row = x.row(i).transpose();
    products.set(basis, row.data(), y(i, 0), 1.0);
    search.add({row.data(), row.data(), y(i, 0), 1.0, 1.0}, basis, products);
  }
  for (int input = 0; input < 3; ++input) {
    const llmt::LeafSearch::Edges edges = search.edges(input);
    ASSERT_GE(edges.thresholds.size(), input == 1 ? 5U : 13U);
    for (std::size_t e = 0; e < edges.thresholds.size(); ++e) {
      std::vector<Eigen::Index> left;
      std::vector<Eigen::Index> right;
      for (Eigen::Index i = 0; i < x.rows(); ++i) {
        if (!std::isnan(x(i, input))) {
          (x(i, input) <= edges.thresholds[e] ? left : right).push_back(i);
        }
      }
      EXPECT_EQ(edges.rows_left[e], std::ssize(left));
      EXPECT_NEAR(edges.rss_left[e], static_cast<double>(oracle::rss(known(left, Eigen::all), y(left, Eigen::all))),
                  1e-9);
      EXPECT_NEAR(edges.rss_right[e], static_cast<double>(oracle::rss(known(right, Eigen::all), y(right, Eigen::all))),
                  1e-9);
    }
  }
}

// The middle of two adjacent doubles is rounded to one of them, the middle of far ones overflows.
TEST(StreamSearch, AnEdgeSeparatesNeighbouringValuesHoweverCloseOrFar) {
  const double low = std::nextafter(1.0, 2.0);
  const double huge = std::numeric_limits<double>::max();
  for (const auto& [left, right] : {std::pair{low, std::nextafter(low, 2.0)}, {-huge, huge}}) {
    llmt::StreamSetting setting = setting_for(1);
    setting.scale(0) = right;
    llmt::LeafSearch search(setting);
    const llmt::Basis basis = origin_basis(1);
    llmt::RowProducts products(setting.shape);
    for (Eigen::Index i = 0; i < llmt::LeafSearch::rows_before_bins; ++i) {
      const double x = i % 2 == 0 ? left : right;
      const double z = setting.scaled(0, x);
      products.set(basis, &z, 1.0, 1.0);
      search.add({&x, &z, 1.0, 1.0, 1.0}, basis, products);
    }
    const llmt::LeafSearch::Edges edges = search.edges(0);
    ASSERT_EQ(edges.thresholds.size(), 1U);
    EXPECT_EQ(edges.rows_left[0], llmt::LeafSearch::rows_before_bins / 2);
    EXPECT_LE(left, edges.thresholds[0]);
    EXPECT_LT(edges.thresholds[0], right);
  }
}

TEST(StreamTree, AThresholdMovesToWhereTheErrorsChangeSides) {
  llmt::ThresholdWatch watch(0.5, 0.1);
  llmt::Random random(1);
  double threshold = 0.5;
  for (int i = 0; i < 20000; ++i) {
    const double x = random.uniform();
    if (watch.concerns(x)) {
      const double e = random.normal();
      const double wrong = (e + 4.0) * (e + 4.0);
      threshold = watch.add(x, x <= 0.53 ? e * e : wrong, x <= 0.53 ? wrong : e * e);
    }
  }
  EXPECT_NEAR(threshold, 0.53, 0.005);
}

TEST(StreamTree, AThresholdStaysWhereItIsRight) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    llmt::ThresholdWatch watch(0.5, 0.1);
    llmt::Random random(seed);
    for (int i = 0; i < 5000; ++i) {
      const double x = random.uniform();
      if (watch.concerns(x)) {
        const double e = random.normal();
        const double wrong = (e + 2.0) * (e + 2.0);
        EXPECT_EQ(watch.add(x, x <= 0.5 ? e * e : wrong, x <= 0.5 ? wrong : e * e), 0.5) << seed;
      }
    }
  }
}

// Learns rows of weight 1 that come once.
void learn(llmt::StreamTree& tree, const Eigen::MatrixXd& x, const Eigen::MatrixXd& y) {
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    const Eigen::VectorXd row = x.row(i).transpose();
    tree.learn({row.data(), row.data(), y(i, 0), 1.0, 1.0});
  }
}

TEST(StreamTree, WithoutAlarmsASplitThatIsNoLongerNeededIsTakenBackToo) {
  llmt::StreamSetting setting = setting_for(2);
  setting.detect_drift = false;
  llmt::StreamTree tree(setting, Eigen::VectorXd::Zero(3));
  const Eigen::MatrixXd x = oracle::uniform(30000, 2, 1);
  learn(tree, x.topRows(3000), kink(x.topRows(3000)) + 0.1 * noise(3000, 2));
  EXPECT_GT(tree.counts().leaves, 1);
  learn(tree, x.bottomRows(27000), affine(x.bottomRows(27000)) + 0.1 * noise(27000, 3));
  EXPECT_GE(tree.counts().prunes, 1);
  EXPECT_EQ(tree.counts().drifts, 0);
}

TEST(StreamTree, WithoutAlarmsAChangeIsLearnedFarMoreSlowly) {
  const Eigen::MatrixXd x = oracle::uniform(12000, 2, 1);
  const Eigen::MatrixXd query = oracle::uniform(1000, 2, 7);
  std::array<double, 2> errors{};
  for (const bool detect : {true, false}) {
    llmt::StreamSetting setting = setting_for(2);
    setting.detect_drift = detect;
    llmt::StreamTree tree(setting, Eigen::VectorXd::Zero(3));
    learn(tree, x.topRows(6000), kink(x.topRows(6000)) + 0.1 * noise(6000, 2));
    learn(tree, x.bottomRows(6000), -kink(x.bottomRows(6000)) + 0.1 * noise(6000, 3));
    for (Eigen::Index i = 0; i < query.rows(); ++i) {
      const Eigen::VectorXd row = query.row(i).transpose();
      const double error = tree.predict({row.data(), row.data(), 0.0, 1.0, 1.0}) + kink(query.row(i))(0, 0);
      errors[detect ? 0 : 1] += error * error;
    }
    EXPECT_EQ(tree.counts().drifts > 0, detect);
  }
  EXPECT_GT(std::sqrt(errors[1]), 4.0 * std::sqrt(errors[0]));
}

TEST(StreamTree, RisesAreSeenAndSteadyErrorsRaiseNoAlarm) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    llmt::Random random(seed);
    llmt::RiseDetector detector;
    for (int i = 0; i < 20000; ++i) {
      const double heavy = random.normal() / std::max(0.3, std::abs(random.normal()));
      EXPECT_FALSE(detector.add(std::abs(heavy))) << seed << " at " << i;
    }
    int rows = 0;
    while (!detector.add(2.0 * std::abs(random.normal() / std::max(0.3, std::abs(random.normal()))))) {
      ++rows;
      ASSERT_LT(rows, 1000) << seed;
    }
  }
}

TEST(Reservoir, IsTheSameWhateverTheOrderAndKnowsRowsAgain) {
  const Eigen::MatrixXd x = oracle::uniform(500, 2, 1);
  llmt::Random random(1);
  llmt::Reservoir forward(50, 2);
  llmt::Reservoir shuffled(50, 2);
  const std::vector<Eigen::Index> order = random.permutation(500);
  for (Eigen::Index i = 0; i < 500; ++i) {
    const Eigen::VectorXd first = x.row(i).transpose();
    const Eigen::VectorXd second = x.row(order[i]).transpose();
    forward.add(first.data());
    shuffled.add(second.data());
  }
  ASSERT_EQ(forward.rows().size(), 50U);
  EXPECT_EQ(forward.different_fraction(), 1.0);
  for (auto left = forward.rows().begin(), right = shuffled.rows().begin(); left != forward.rows().end();
       ++left, ++right) {
    EXPECT_EQ(left->second.values, right->second.values);
  }
  for (int pass = 0; pass < 3; ++pass) {
    for (Eigen::Index i = 0; i < 500; ++i) {
      const Eigen::VectorXd row = x.row(i).transpose();
      forward.add(row.data());
    }
  }
  EXPECT_EQ(forward.rows().size(), 50U);
  EXPECT_EQ(forward.different_fraction(), 0.25);
}

TEST(BlendCorrection, IsTheAnchoredLeastSquaresFit) {
  const Eigen::MatrixXd x = oracle::uniform(200, 2, 1);
  const Eigen::MatrixXd y = oracle::curved(x, 0.05);
  llmt::FitOptions options;
  options.max_leaves = 4;
  options.folds.count = 0;
  llmt::Partition partition = llmt::fit(x, y, options).model.partitions().front();
  ASSERT_EQ(partition.num_leaves(), 4);
  const llmt::Table table{x, y, Eigen::VectorXd::Ones(200), {0, 0}, {0, 1}, {0, 1}};
  std::vector<int> all(200);
  std::iota(all.begin(), all.end(), 0);
  const llmt::TrainingRows rows = llmt::training_rows(table, all);
  partition.validity = {llmt::ValidityKind::blend, 1.0};
  llmt::set_half_widths(partition, rows.low(), rows.high());
  const double ridge = 0.1;
  const llmt::BlendCorrection correction(rows, partition);
  const llmt::Partition corrected = correction.corrected(ridge);

  // The same by dense normal equations.
  const llmt::Model model(rows.columns, rows.output_columns, rows.regressors, {partition});
  const Eigen::MatrixXd phi = model.validities(x, 0);
  std::vector<int> leaves;
  for (const llmt::Leaf& leaf : model.leaves(0)) {
    leaves.push_back(leaf.node);
  }
  Eigen::MatrixXd a(200, 12);
  Eigen::VectorXd residual = y.col(0);
  Eigen::MatrixXd hold = Eigen::MatrixXd::Zero(12, 12);
  const Eigen::MatrixXd one =
      with_one(x.rowwise() - Eigen::RowVector2d(rows.regressors[0].centre, rows.regressors[1].centre));
  for (int i = 0; i < 4; ++i) {
    const llmt::Node& node = partition.nodes[leaves[i]];
    a.middleCols(3 * i, 3) = phi.col(i).asDiagonal() * one;
    residual -= phi.col(i).cwiseProduct(one * (Eigen::VectorXd(3) << node.value, node.slope.transpose()).finished());
    hold.block(3 * i, 3 * i, 3, 3) = ridge * one.transpose() * phi.col(i).asDiagonal() * one;
  }
  const Eigen::VectorXd change = (a.transpose() * a + hold).llt().solve(a.transpose() * residual);
  for (int i = 0; i < 4; ++i) {
    const std::size_t node = leaves[i];
    const Eigen::Vector3d found(corrected.nodes[node].value(0) - partition.nodes[node].value(0),
                                corrected.nodes[node].slope(0, 0) - partition.nodes[node].slope(0, 0),
                                corrected.nodes[node].slope(0, 1) - partition.nodes[node].slope(0, 1));
    EXPECT_LT((found - change.segment(3 * i, 3)).norm(), 0.01 * change.norm()) << i;
  }
}

}  // namespace
