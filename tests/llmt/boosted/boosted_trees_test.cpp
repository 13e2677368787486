// The parts of a boosted tree against plain formulas.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "boosted/growing_tree.hpp"
#include "boosted/symmetric_grower.hpp"
#include "llmt/boosted/some_rows.hpp"
#include "oracles/boosted_formula.hpp"

namespace {

using boosted_tests::missing;
using boosted_tests::Rows;
using boosted_tests::some_rows;

std::vector<llmt::PackedSum> packed_rows(const Rows& rows, llmt::PackedUnits& units) {
  units = llmt::units_of(std::span(rows.y.data(), rows.y.size()),
                         std::span(rows.binned.weights.data(), rows.binned.weights.size()), rows.binned.equal_weights);
  std::vector<llmt::PackedSum> terms;
  for (const int row : rows.all) terms.push_back(llmt::packed(rows.y(row), rows.binned.weights(row), units));
  return terms;
}

llmt::Histogram histogram_of(const llmt::BinnedFeature& feature, const std::vector<int>& rows,
                             const std::vector<llmt::PackedSum>& all_terms) {
  std::vector<llmt::PackedSum> terms;
  for (const int row : rows) terms.push_back(all_terms[row]);
  llmt::Histogram histogram{};
  const llmt::HistogramOf of_feature{feature.bins.data(), &histogram};
  llmt::add_to(std::span(&of_feature, 1), rows, terms);
  return histogram;
}

// What a constant and, if asked for, a slope with their ridges explain of the rows of one side.
double gain_of_side(const Rows& rows, int feature, const std::vector<int>& side, const llmt::Ridges& ridges,
                    bool slopes) {
  const llmt::BinnedFeature& column = rows.binned.features[feature];
  double n = 0.0;
  double s = 0.0;
  double mean = 0.0;
  const auto centre = [&](int row) {
    return column.bins[row] == llmt::missing_bin ? 0.0 : column.centres[column.bins[row]];
  };
  for (const int row : side) {
    n += rows.binned.weights(row);
    s += rows.binned.weights(row) * rows.y(row);
    mean += rows.binned.weights(row) * centre(row);
  }
  if (n == 0.0) return 0.0;
  mean /= n;
  double zz = 0.0;
  double ze = 0.0;
  for (const int row : side) {
    zz += rows.binned.weights(row) * (centre(row) - mean) * (centre(row) - mean);
    ze += rows.binned.weights(row) * (centre(row) - mean) * rows.y(row);
  }
  return s * s / (n + ridges.constant) + (slopes ? ze * ze / (zz + ridges.slope) : 0.0);
}

TEST(BinnedFeature, HoldsEachRowBetweenItsEdges) {
  const Rows rows = some_rows(3000, 3, true, 0.1, 1);
  for (int j = 0; j < 3; ++j) {
    const llmt::BinnedFeature& feature = rows.binned.features[j];
    EXPECT_EQ(feature.num_bins(), j == 1 ? 6 : llmt::most_bins);
    EXPECT_EQ(feature.last_cells.back(), std::ssize(feature.edges));
    for (const int row : rows.all) {
      const double z = rows.z(row, j);
      const int cell = feature.cells[row];
      const int bin = feature.bins[row];
      if (std::isnan(z)) {
        EXPECT_EQ(cell, llmt::missing_cell);
        EXPECT_EQ(bin, llmt::missing_bin);
        continue;
      }
      EXPECT_TRUE(cell == 0 || z > feature.edges[cell - 1]);
      EXPECT_TRUE(cell == std::ssize(feature.edges) || z <= feature.edges[cell]);
      EXPECT_TRUE(bin == 0 || cell > feature.last_cells[bin - 1]);
      EXPECT_LE(cell, feature.last_cells[bin]);
    }
  }
}

TEST(PackedSums, OfOneChildAreThoseOfTheNodeMinusThoseOfTheOther) {
  for (const bool weighted : {false, true}) {
    const Rows rows = some_rows(2000, 2, weighted, 0.1, 2);
    llmt::PackedUnits units;
    const std::vector<llmt::PackedSum> terms = packed_rows(rows, units);
    std::vector<int> left;
    std::vector<int> right;
    for (const int row : rows.all) (rows.z(row, 1) < 3.0 ? left : right).push_back(row);
    const llmt::BinnedFeature& feature = rows.binned.features[0];
    const llmt::Histogram node = histogram_of(feature, rows.all, terms);
    const llmt::Histogram of_left = histogram_of(feature, left, terms);
    const llmt::Histogram of_right = histogram_of(feature, right, terms);
    for (std::size_t b = 0; b < node.size(); ++b) EXPECT_EQ(node[b] - of_left[b], of_right[b]) << b;
  }
}

TEST(PackedSums, OfTwoFeaturesAreThoseOfEach) {
  const Rows rows = some_rows(500, 2, true, 0.1, 4);
  llmt::PackedUnits units;
  const std::vector<llmt::PackedSum> terms = packed_rows(rows, units);
  std::array<llmt::Histogram, 2> sums{};
  const std::array<llmt::HistogramOf, 2> both{
      {{rows.binned.features[0].bins.data(), &sums[0]}, {rows.binned.features[1].bins.data(), &sums[1]}}};
  llmt::add_to(both, rows.all, terms);
  for (int k = 0; k < 2; ++k) EXPECT_EQ(sums[k], histogram_of(rows.binned.features[k], rows.all, terms));
}

TEST(PackedSums, AreWithinHalfAUnitARow) {
  const Rows rows = some_rows(2000, 1, true, 0.0, 3);
  llmt::PackedUnits units;
  const std::vector<llmt::PackedSum> terms = packed_rows(rows, units);
  llmt::PackedSum sum = 0;
  for (const llmt::PackedSum term : terms) sum += term;
  const double count = static_cast<double>(terms.size());
  EXPECT_NEAR(static_cast<double>(llmt::weight_of(sum)) * units.weight, rows.binned.weights.sum(),
              0.5 * count * units.weight);
  EXPECT_NEAR(static_cast<double>(llmt::residual_of(sum)) * units.residual, rows.binned.weights.dot(rows.y),
              0.5 * count * units.residual);
  EXPECT_LT(units.residual, 1e-5);
}

TEST(SplitGain, EqualsBruteForce) {
  const llmt::Ridges ridges{.constant = 2.0, .slope = 1.5};
  for (const bool weighted : {false, true}) {
    for (const bool slopes : {false, true}) {
      for (const bool missing_left : {false, true}) {
        const Rows rows = some_rows(300, 3, weighted, 0.1, 4);
        llmt::PackedUnits units;
        const std::vector<llmt::PackedSum> terms = packed_rows(rows, units);
        const std::vector<int> node(rows.all.begin() + 50, rows.all.begin() + 120);  // many bins are empty
        for (int j = 0; j < 3; ++j) {
          const llmt::BinnedFeature& feature = rows.binned.features[j];
          llmt::Gains gains{};
          llmt::add_gains(gains, feature, histogram_of(feature, node, terms), units, ridges, slopes, missing_left);
          const double of_node = gain_of_side(rows, j, node, ridges, false);
          for (int t = 0; t + 1 < feature.num_bins(); ++t) {
            std::vector<int> left;
            std::vector<int> right;
            for (const int row : node) {
              const int bin = feature.bins[row];
              (bin == llmt::missing_bin ? missing_left : bin <= t) ? left.push_back(row) : right.push_back(row);
            }
            const double expected =
                gain_of_side(rows, j, left, ridges, slopes) + gain_of_side(rows, j, right, ridges, slopes) - of_node;
            EXPECT_NEAR(gains[t], expected, 1e-4) << j << " " << t;
          }
        }
      }
    }
  }
}

// The model of a node that the equations give, from its parent's.
struct Path {
  double constant = 0.0;
  Eigen::VectorXd slope;
  double at(const Eigen::VectorXd& z) const { return constant + slope.dot(z); }
};

Path ridge_about(const Path& path, const Rows& rows, const std::vector<int>& side, const std::vector<int>& features,
                 const llmt::Ridges& ridges) {
  const Eigen::Index size = std::ssize(features);
  double n = 0.0;
  double s = 0.0;
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(size);
  for (const int row : side) {
    const double w = rows.binned.weights(row);
    n += w;
    s += w * (rows.y(row) - path.at(rows.z.row(row)));
    mean += w * rows.z(row, features).transpose();
  }
  mean /= n;
  Eigen::MatrixXd a = ridges.slope * Eigen::MatrixXd::Identity(size, size);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(size);
  for (const int row : side) {
    const Eigen::VectorXd d = rows.z(row, features).transpose() - mean;
    a += rows.binned.weights(row) * d * d.transpose();
    b += rows.binned.weights(row) * d * (rows.y(row) - path.at(rows.z.row(row)));
  }
  const Eigen::VectorXd slopes = a.ldlt().solve(b);
  Path result = path;
  result.constant += s / (n + ridges.constant) - slopes.dot(mean);
  for (Eigen::Index k = 0; k < size; ++k) result.slope(features[k]) += slopes(k);
  return result;
}

void expect_ridges(const llmt::GrowingTree& tree, const Rows& rows, int index, const std::vector<int>& held,
                   const Path& path, const llmt::Ridges& ridges) {
  const llmt::GrowingNode& node = tree[index];
  if (node.feature < 0) {
    if (held.empty()) return;
    const Path expected =
        ridge_about(path, rows, held, {node.model.features.begin(), node.model.features.end()}, ridges);
    EXPECT_NEAR(node.model.constant, expected.constant, 1e-9);
    for (std::size_t k = 0; k < node.model.features.size(); ++k) {
      EXPECT_NEAR(node.model.slopes[k], expected.slope(node.model.features[k]), 1e-9);
    }
    return;
  }
  for (const bool is_left : {true, false}) {
    std::vector<int> side;
    for (const int row : held) {
      if ((rows.binned.features[node.feature].cells[row] <= node.cell) == is_left) side.push_back(row);
    }
    const Path below = side.empty() ? path : ridge_about(path, rows, side, {node.feature}, ridges);
    expect_ridges(tree, rows, is_left ? node.left : node.right, side, below, ridges);
  }
}

// By the grower that boosting takes.
llmt::GrowingTree grown(const Rows& rows, const llmt::TreeOptions& options, const Eigen::VectorXd& y) {
  llmt::Random random(1);
  const Eigen::Index count = std::ssize(rows.all);
  if (options.symmetric) return llmt::SymmetricGrower(rows.binned, count, options, 1).grow(y, random);
  return llmt::TreeGrower(rows.binned, count, options, 1).grow(y, random);
}

TEST(BoostedTree, HasInItsLeavesRidgeAboutTheirPath) {
  for (const bool symmetric : {true, false}) {
    const Rows rows = some_rows(400, 3, true, 0.0, 5);
    llmt::TreeOptions options;
    options.symmetric = symmetric;
    options.depth = 3;
    options.leaves = 7;
    options.columns = 1.0;
    const llmt::GrowingTree tree = grown(rows, options, rows.y);
    EXPECT_GT(tree.size(), 8U);
    const Path root{rows.binned.weights.dot(rows.y) / rows.binned.weights.sum(), Eigen::VectorXd::Zero(3)};
    expect_ridges(tree, rows, 0, rows.all, root, options.ridges);
  }
}

// A step between two values of a bin: the split is between these values.
TEST(BoostedTree, SplitsInsideOfABin) {
  for (const bool symmetric : {true, false}) {
    const Rows rows = some_rows(3000, 1, false, 0.1, 8);
    for (const double step : {-0.301, 0.1, 0.502}) {
      Eigen::VectorXd y(rows.z.rows());
      double below = -std::numeric_limits<double>::infinity();
      double above = -below;
      for (const int row : rows.all) {
        const double z = rows.z(row, 0);
        y(row) = z > step ? 1.0 : 0.0;
        if (z <= step) below = std::max(below, z);
        if (z > step) above = std::min(above, z);
      }
      llmt::TreeOptions options;
      options.symmetric = symmetric;
      options.depth = 1;
      options.leaves = 2;
      options.columns = 1.0;
      const llmt::GrowingTree tree = grown(rows, options, y);
      ASSERT_EQ(tree.front().feature, 0);
      EXPECT_EQ(rows.binned.features[0].edges[tree.front().cell], below + (above - below) / 2.0);
    }
  }
}

// One leaf: the weighted mean. Its one leaf has no path, so no slope.
TEST(BoostedTree, OfOneLeafIsTheMean) {
  const Rows rows = some_rows(100, 2, true, 0.0, 6);
  llmt::TreeOptions options;
  options.depth = 0;
  const llmt::GrowingTree tree = grown(rows, options, rows.y);
  ASSERT_EQ(tree.size(), 1U);
  const double mean = rows.binned.weights.dot(rows.y) / rows.binned.weights.sum();
  for (const int row : rows.all) EXPECT_NEAR(llmt::value_at(tree, rows.binned, row), mean, 1e-12);
}

// The same rows, so the same leaves.
TEST(BoostedTree, IsTheSameWhenItsLeavesAreEstimatedAnew) {
  for (const double softness : {0.0, 0.6}) {
    const Rows rows = some_rows(500, 3, false, 0.1, 7);
    llmt::TreeOptions options;
    options.depth = 4;
    options.softness = softness;
    llmt::TreeGrower grower(rows.binned, std::ssize(rows.all), options, 1);
    llmt::Random random(3);
    const llmt::GrowingTree grown = grower.grow(rows.y, random);
    const llmt::GrowingTree again = grower.estimate(grown, rows.y);
    double largest = 0.0;
    Eigen::VectorXd left = rows.y;
    grower.subtract_last(again, 0.25, left);
    for (const int row : rows.all) {
      const double value = llmt::value_at(grown, rows.binned, row);
      largest = std::max(largest, std::abs(value - llmt::value_at(again, rows.binned, row)));
      EXPECT_NEAR(left(row), rows.y(row) - 0.25 * value, 1e-9);
    }
    EXPECT_LT(largest, 1e-9);
  }
}

TEST(BoostedTree, OfSoftSplitsBlendsTheSidesOfARow) {
  const Rows rows = some_rows(2000, 2, false, 0.0, 8);
  const Eigen::VectorXd smooth = rows.z.col(0).array().cube();
  for (const int depth : {1, 3}) {
    llmt::TreeOptions options;
    options.softness = 0.6;
    options.depth = depth;
    options.columns = 1.0;
    llmt::TreeGrower grower(rows.binned, std::ssize(rows.all), options, 1);
    llmt::Random random(1);
    const llmt::GrowingTree tree = grower.grow(smooth, random);
    const llmt::BoostedTree done = llmt::finished(tree, rows.binned);
    llmt::GrowingTree crisp = tree;
    for (llmt::GrowingNode& node : crisp) node.half_width = 0.0;
    int rows_that_blend = 0;
    double largest = 0.0;  // distance from what the row's own side says
    for (const int row : rows.all) {
      int blends = 0;
      const double value = llmt::value_at(tree, rows.binned, row);
      const std::vector<double> z = {rows.z(row, 0), rows.z(row, 1)};
      EXPECT_NEAR(value, boosted_formula::tree_at(done, z, blends), 1e-12);
      rows_that_blend += blends > 0 ? 1 : 0;
      largest = std::max(largest, std::abs(value - llmt::value_at(crisp, rows.binned, row)));
    }
    EXPECT_GT(rows_that_blend, 200) << depth;
    EXPECT_GT(largest, 0.05) << depth;
  }
}

}  // namespace
