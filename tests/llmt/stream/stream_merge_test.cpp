// Streams that learned apart and were merged, beside one that saw all rows.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

#include "llmt/fit.hpp"
#include "llmt/stream.hpp"
#include "oracles/oracles.hpp"
#include "oracles/stream_data.hpp"
#include "oracles/thrown.hpp"

namespace {

using llmt::Stream;
using namespace stream_data;

constexpr llmt::StreamOptions exact{.shrinkage = 0.0, .reservoir_rows = 0};

Stream after(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y, Eigen::Index begin, Eigen::Index end,
             const llmt::StreamOptions& options) {
  Stream stream(x.cols(), y.cols(), options);
  stream.add(x.middleRows(begin, end - begin), y.middleRows(begin, end - begin));
  return stream;
}

void expect_least_squares(const llmt::Leaf& leaf, const Eigen::MatrixXd& x, const Eigen::VectorXd& y) {
  const Eigen::VectorXd expected = oracle::least_squares(with_one(x), y);
  EXPECT_EQ(leaf.samples, x.rows());
  EXPECT_LT((leaf.slope.transpose() - expected.tail(x.cols())).norm(), 1e-9);
  EXPECT_NEAR(leaf.intercept(0), expected(0), 1e-9);
  EXPECT_NEAR(std::pow(leaf.rmse(0), 2) * static_cast<double>(x.rows()), static_cast<double>(oracle::rss(x, y)), 1e-9);
}

TEST(StreamMerge, OneLeafIsLeastSquaresOfAllRows) {
  Eigen::MatrixXd x = oracle::uniform(900, 3, 1);
  x.bottomRows(500).array() += 7.0;  // other units: the second stream is centred and scaled by its own first rows
  x.bottomRows(500).col(1) *= 5.0;
  const Eigen::MatrixXd y = affine(x) + 0.3 * noise(900, 2);
  const Stream merged = merge(after(x, y, 0, 400, exact), after(x, y, 400, 900, exact));
  const std::vector<llmt::Leaf> leaves = merged.snapshot().leaves(0);
  ASSERT_EQ(leaves.size(), 1U);
  expect_least_squares(leaves[0], x, y.col(0));
  EXPECT_EQ(merged.counts().rows, 900);
}

// Every second row lies above 0.1, the others below -0.1: whatever threshold between them a stream has, its split is
// the same.
TEST(StreamMerge, LeavesOnTheSameSideOfASplitAreAddedExactly) {
  Eigen::MatrixXd x = oracle::uniform(4000, 2, 1);
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    const double size = 0.1 + 0.9 * std::abs(x(i, 0));
    x(i, 0) = i % 2 == 0 ? size : -size;
  }
  const Eigen::MatrixXd y =
      (x.col(0).array() > 0.0).select(9.0 + x.col(1).array(), -x.col(0).array()).matrix() + 0.1 * noise(4000, 2);
  llmt::StreamOptions options = exact;
  options.max_leaves = 2;
  const Stream merged = merge(after(x, y, 0, 2500, options), after(x, y, 2500, 4000, options));
  const std::vector<llmt::Leaf> leaves = merged.snapshot().leaves(0);
  ASSERT_EQ(leaves.size(), 2U);
  for (Eigen::Index side = 0; side < 2; ++side) {
    const auto below = Eigen::seqN(1 - side, 2000, 2);
    expect_least_squares(leaves[side], x(below, Eigen::all), y(below, 0));
  }
}

TEST(StreamMerge, FewFirstRowsAreLearnedAsIfTheyCameLast) {
  const Eigen::MatrixXd x = oracle::uniform(3000, 3, 1);
  const Eigen::MatrixXd y = oracle::curved(x, 0.1);
  const Stream whole = after(x, y, 0, 3000, {});
  EXPECT_EQ(to_json(merge(after(x, y, 2970, 3000, {}), after(x, y, 0, 2970, {}))), to_json(whole));
}

TEST(StreamMerge, ShardsTogetherPredictBetterThanAlone) {
  const Eigen::MatrixXd x = oracle::uniform(8000, 3, 1);
  const Eigen::MatrixXd y = oracle::curved(x, 0.5);
  const Eigen::MatrixXd fresh = oracle::uniform(4000, 3, 9);
  const Eigen::MatrixXd truth = oracle::curved(fresh);
  const auto error = [&](const Stream& stream) { return llmt::rmse(stream.snapshot().predict(fresh), truth)(0); };
  const Stream merged = merge(merge(after(x, y, 0, 2000, {}), after(x, y, 2000, 4000, {})),
                              merge(after(x, y, 4000, 6000, {}), after(x, y, 6000, 8000, {})));
  EXPECT_LT(error(merged), 0.8 * error(after(x, y, 0, 2000, {})));
  EXPECT_LT(error(merged), 1.3 * error(after(x, y, 0, 8000, {})));
}

// The sample of a stream does not depend on the order of its rows, so only the rows before the second tree differ.
TEST(StreamMerge, TheSampleIsThatOfAllRows) {
  const Eigen::MatrixXd x = oracle::uniform(3000, 2, 1);
  const Eigen::MatrixXd y = affine(x) + noise(3000, 2);
  const llmt::StreamOptions options{.reservoir_rows = 300};
  const auto sample_of = [](const Stream& stream) {
    return nlohmann::ordered_json::parse(to_json(stream))["reservoir"];
  };
  Stream whole = after(x, y, 0, 1500, options);
  whole.add(x.bottomRows(1450), y.bottomRows(1450));
  EXPECT_EQ(sample_of(merge(after(x, y, 0, 1500, options), after(x, y, 1500, 3000, options))), sample_of(whole));
}

TEST(StreamMerge, AMergedStreamGoesOnAndIsWritten) {
  const Eigen::MatrixXd x = oracle::uniform(6000, 3, 1);
  const Eigen::MatrixXd y = oracle::curved(x, 0.1);
  Stream merged = merge(after(x, y, 0, 2000, {}), after(x, y, 2000, 4000, {}));
  Stream loaded = llmt::stream_from_json(to_json(merged));
  for (Stream* stream : {&merged, &loaded}) stream->add(x.bottomRows(2000), y.bottomRows(2000));
  EXPECT_EQ(merged.counts().rows, 6000);
  EXPECT_EQ(to_json(merged), to_json(loaded));
}

TEST(StreamMerge, WhatDoesNotGoTogetherIsRefused) {
  const auto refused = [](Stream a, Stream b) {
    return oracle::thrown<std::invalid_argument>([&] { merge(std::move(a), std::move(b)); });
  };
  EXPECT_EQ(refused(Stream(2, 1), Stream(3, 1)), "llmt::merge: 2 inputs and 1 outputs do not go with 3 and 1");
  EXPECT_EQ(refused(Stream(2, 1), Stream(2, 1, {.bins = 8})), "llmt::merge: the streams have different options");
}

}  // namespace
