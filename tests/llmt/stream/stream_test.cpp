#include "llmt/stream.hpp"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <limits>

#include "llmt/fit.hpp"
#include "oracles/oracles.hpp"
#include "oracles/stream_data.hpp"
#include "stream/sums.hpp"

namespace {

using llmt::GramShape;
using llmt::Stream;
using namespace stream_data;

TEST(Stream, ALeafModelIsLeastSquaresOfAllItsRows) {
  const Eigen::MatrixXd x = oracle::uniform(700, 3, 1);
  const Eigen::MatrixXd y = affine(x) + 0.3 * noise(700, 2);
  Stream stream(3, 1, {.shrinkage = 0.0, .reservoir_rows = 0});
  stream.add(x, y);
  const llmt::Model model = stream.snapshot();
  const std::vector<llmt::Leaf> leaves = model.leaves(0);
  ASSERT_EQ(leaves.size(), 1U);
  const Eigen::VectorXd expected = oracle::least_squares(with_one(x), y.col(0));
  EXPECT_LT((leaves[0].slope.transpose() - expected.tail(3)).norm(), 1e-9);
  EXPECT_NEAR(leaves[0].intercept(0), expected(0), 1e-9);
  EXPECT_EQ(leaves[0].samples, 700);
  EXPECT_NEAR(std::pow(leaves[0].rmse(0), 2) * 700.0, static_cast<double>(oracle::rss(x, y)), 1e-9);
  // The live tree solves anew when rows have grown by a twentieth.
  EXPECT_LT(llmt::rmse(stream.predict(x), model.predict(x))(0), 0.01);
}

TEST(Stream, OneRowAtATimeOrInBlocksGivesTheSameBytes) {
  const Eigen::MatrixXd x = oracle::uniform(3000, 3, 1);
  const Eigen::MatrixXd y = oracle::curved(x, 0.1);
  Stream whole(3, 1);
  Stream rows(3, 1);
  whole.add(x, y);
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    rows.add(x.row(i), y.row(i));
  }
  EXPECT_GT(whole.counts().leaves, 1);
  EXPECT_EQ(llmt::to_json(whole.snapshot()), llmt::to_json(rows.snapshot()));
}

TEST(Stream, LearnsASmoothFunctionFarBetterThanOneModel) {
  const Eigen::MatrixXd x = oracle::uniform(20000, 3, 1);
  const Eigen::MatrixXd y = oracle::curved(x, 0.1);
  const Eigen::MatrixXd fresh = oracle::uniform(2000, 3, 9);
  const Eigen::MatrixXd truth = oracle::curved(fresh);
  llmt::FitOptions one_leaf;
  one_leaf.max_leaves = 1;
  one_leaf.folds.count = 0;
  const double linear = llmt::rmse(llmt::fit(x, y, one_leaf).model.predict(fresh), truth)(0);
  Stream stream(3, 1);
  stream.add(x, y);
  const double live = llmt::rmse(stream.predict(fresh), truth)(0);
  EXPECT_LT(live, 0.15 * linear);
  EXPECT_LT(llmt::rmse(stream.snapshot().predict(fresh), truth)(0), 1.05 * live);
  // Test then train: noise and what was not yet learned.
  EXPECT_GT(stream.prequential_rmse()(0), 0.1);
  EXPECT_LT(stream.recent_rmse()(0), 0.13);
}

TEST(Stream, AJumpIsFoundFarMoreCloselyThanABinIsWide) {
  const Eigen::MatrixXd x = oracle::uniform(5000, 2, 1);
  const Eigen::MatrixXd y = (x.col(0).array() > 0.3713).select(4.0, x.col(1)).matrix() + noise(5000, 2);
  Stream stream(2, 1);
  stream.add(x, y);
  // Rows on the wrong side of the jump, as a width: a bin is 0.13 wide.
  const Eigen::MatrixXd fresh = oracle::uniform(20000, 2, 3);
  const Eigen::ArrayXd truth = (fresh.col(0).array() > 0.3713).select(4.0, fresh.col(1)).array();
  const Eigen::Index wrong = ((stream.predict(fresh).col(0).array() - truth).abs() > 1.5).count();
  EXPECT_LT(2.0 * static_cast<double>(wrong) / 20000.0, 0.01);
}

TEST(Stream, AffineDataAreNeverSplit) {
  for (const double offset : {0.0, 1e6}) {
    const Eigen::MatrixXd x = oracle::uniform(3000, 3, 1).array() + offset;
    const Eigen::MatrixXd y = affine(x);
    Stream stream(3, 1);
    stream.add(x, y);
    EXPECT_EQ(stream.counts().splits, 0) << offset;
    EXPECT_LT((stream.snapshot().predict(x) - y).norm() / y.norm(), 1e-7);
  }
}

TEST(Stream, NoiseIsSplitNoMoreOftenThanTheSignificanceAllows) {
  // Each stream is split with a probability of at most 0.05, whenever it is looked at: among 100, more than 14 have
  // one with a probability of 1e-4.
  int split = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    Stream stream(2, 1, {.reservoir_rows = 0});
    stream.add(oracle::uniform(1500, 2, seed), noise(1500, 1000 + seed));
    split += stream.counts().splits > 0 ? 1 : 0;
  }
  EXPECT_LE(split, 14);
}

TEST(Stream, RowsThatComeAgainAreNoNewEvidence) {
  int split = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Stream stream(2, 1);
    const Eigen::MatrixXd x = oracle::uniform(150, 2, seed);
    const Eigen::MatrixXd y = noise(150, 1000 + seed);
    for (int pass = 0; pass < 20; ++pass) {
      stream.add(x, y);
    }
    split += stream.counts().splits > 0 ? 1 : 0;
  }
  // As above: more than 6 of 20 have a probability of 3e-5.
  EXPECT_LE(split, 6);
}

TEST(Stream, ASplitThatIsNoLongerNeededIsTakenBack) {
  const Eigen::MatrixXd x = oracle::uniform(30000, 2, 1);
  const Eigen::MatrixXd curved = kink(x.topRows(3000)) + 0.1 * noise(3000, 2);
  const Eigen::MatrixXd straight = affine(x.bottomRows(27000)) + 0.1 * noise(27000, 3);
  Stream stream(2, 1);
  stream.add(x.topRows(3000), curved);
  EXPECT_GT(stream.counts().leaves, 1);
  stream.add(x.bottomRows(27000), straight);
  EXPECT_EQ(stream.counts().leaves, 1);
  EXPECT_GE(stream.counts().drifts, 1);
}

TEST(Stream, AChangeIsSeenAndLearned) {
  const Eigen::MatrixXd x = oracle::uniform(12000, 2, 1);
  const Eigen::MatrixXd before = kink(x.topRows(6000)) + 0.1 * noise(6000, 2);
  const Eigen::MatrixXd after = -kink(x.bottomRows(6000)) + 0.1 * noise(6000, 3);
  Stream stream(2, 1);
  stream.add(x.topRows(6000), before);
  EXPECT_EQ(stream.counts().drifts, 0);
  stream.add(x.bottomRows(6000), after);
  Stream fresh(2, 1);
  fresh.add(x.bottomRows(6000), after);
  const Eigen::MatrixXd query = oracle::uniform(1000, 2, 7);
  const double error = llmt::rmse(stream.predict(query), -kink(query))(0);
  EXPECT_GE(stream.counts().drifts, 1);
  EXPECT_LT(error, 1.5 * llmt::rmse(fresh.predict(query), -kink(query))(0));
  EXPECT_LT(llmt::rmse(stream.snapshot().predict(query), -kink(query))(0), 0.05);
}

TEST(Stream, NoAlarmWithoutAChange) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Stream stream(3, 1);
    const Eigen::MatrixXd x = oracle::uniform(10000, 3, seed);
    stream.add(x, oracle::curved(x, 0.2, seed));
    EXPECT_EQ(stream.counts().drifts, 0) << seed;
  }
}

TEST(Stream, MemoryHasABound) {
  Stream stream(3, 1, {.max_leaves = 6, .reservoir_rows = 1000});
  Eigen::Index most = 0;
  for (std::uint64_t block = 1; block <= 40; ++block) {
    const Eigen::MatrixXd x = oracle::uniform(1000, 3, block);
    stream.add(x, oracle::curved(x, 0.01, block));
    EXPECT_LE(stream.counts().leaves, 6);
    most = std::max(most, stream.counts().bytes);
  }
  // Of a leaf: bins of every input; of the reservoir: what a row holds and its place in the map.
  const Eigen::Index gram = GramShape(4, 1).size() * 8;
  EXPECT_LE(most, 6 * (3 * 16 * gram + 20 * gram) + 1000 * (5 * 8 + 96) + 10000);
}

TEST(Stream, MissingValuesAreLearnedWith) {
  Eigen::MatrixXd x = oracle::uniform(20000, 2, 1);
  const Eigen::MatrixXd y = kink(x) + 0.1 * noise(20000, 2);
  llmt::Random random(5);
  for (double& value : x.reshaped()) {
    value = random.uniform() < 0.1 ? std::numeric_limits<double>::quiet_NaN() : value;
  }
  Stream stream(2, 1);
  stream.add(x, y);
  EXPECT_GT(stream.counts().missing_values, 3000);
  EXPECT_TRUE(stream.predict(x).allFinite());
  const Eigen::MatrixXd query = oracle::uniform(1000, 2, 7);
  EXPECT_LT(llmt::rmse(stream.snapshot().predict(query), kink(query))(0), 0.1);
  EXPECT_TRUE(stream.snapshot().predict(x).allFinite());
}

TEST(Stream, RowsOfWeightZeroTakeNoPart) {
  const Eigen::MatrixXd x = oracle::uniform(2000, 2, 1);
  Eigen::MatrixXd y = kink(x) + 0.1 * noise(2000, 2);
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(2000);
  Stream kept(2, 1);
  for (Eigen::Index i = 0; i < 2000; ++i) {
    if (i % 3 == 0) {
      weights(i) = 0.0;
    } else {
      kept.add(x.row(i), y.row(i));
    }
  }
  Stream weighted(2, 1);
  weighted.add(x, y, weights);
  EXPECT_EQ(llmt::to_json(weighted.snapshot()), llmt::to_json(kept.snapshot()));
}

TEST(Stream, ASnapshotIsAnOrdinaryModel) {
  const Eigen::MatrixXd x = oracle::uniform(8000, 3, 1);
  Eigen::MatrixXd y(8000, 2);
  y << oracle::curved(x, 0.1), affine(x);
  Stream stream(3, 2);
  stream.add(x, y);
  for (const llmt::ValidityChoice validity :
       {llmt::ValidityChoice::automatic, llmt::ValidityChoice::crisp, llmt::ValidityChoice::blend}) {
    const llmt::Model model = stream.snapshot(validity);
    EXPECT_EQ(model.num_outputs(), 2);
    const llmt::Model read = llmt::from_json(llmt::to_json(model));
    EXPECT_EQ(read.predict(x), model.predict(x));
    EXPECT_EQ(model.jacobian(x.row(0).transpose()).rows(), 2);
    EXPECT_TRUE(model.standard_errors(x.topRows(10)).allFinite());
    EXPECT_GT(model.extrapolation(Eigen::RowVector3d(3.0, 0.0, 0.0))[0].distance, 0.9);
    EXPECT_EQ(model.partitions()[0].validity.kind == llmt::ValidityKind::crisp,
              validity == llmt::ValidityChoice::crisp || model.partitions()[0].num_leaves() == 1 ||
                  model.partitions()[0].validity.width == 0.0);
  }
  // A linear output stays one leaf and is continued linearly.
  const Eigen::MatrixXd far = 3.0 * oracle::uniform(50, 3, 8);
  EXPECT_LT((stream.snapshot().predict(far).col(1) - affine(far)).norm(), 1e-6);
}

TEST(Stream, AFewRowsGiveALinearModel) {
  const Eigen::MatrixXd x = oracle::uniform(10, 2, 1);
  Stream stream(2, 1);
  try {
    stream.snapshot();
    FAIL() << "a snapshot without a row";
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "llmt::Stream: snapshot(): there is no row yet");
  }
  EXPECT_TRUE(stream.predict(x).array().isNaN().all());
  stream.add(x, affine(x));
  EXPECT_LT((stream.snapshot().predict(x) - affine(x)).norm(), 1e-9);
  EXPECT_TRUE(std::isnan(stream.prequential_rmse()(0)));
}

TEST(Stream, LeveragesAreThoseOfAllRowsThatALeafHasSeen) {
  Eigen::MatrixXd x = oracle::uniform(400, 2, 3);
  x.col(1) = 50.0 * x.col(1).array() + 1000.0;
  Stream stream(2, 1);
  stream.add(x, affine(x));
  const llmt::Model model = stream.snapshot();
  ASSERT_EQ(model.partitions()[0].nodes.size(), 1U);
  const Eigen::MatrixXd a = with_one(x);
  Eigen::MatrixXd query = x.topRows(3);
  query.row(2) << 4.0, 900.0;
  const std::vector<llmt::Extrapolation> told = model.extrapolation(query);
  for (Eigen::Index i = 0; i < 3; ++i) {
    const Eigen::Vector3d row(1.0, query(i, 0), query(i, 1));
    const double leverage = row.dot((a.transpose() * a).colPivHouseholderQr().solve(row));
    // One row in eight is held out.
    const double rows = static_cast<double>(model.partitions()[0].nodes[0].samples) / 400.0;
    EXPECT_NEAR(told[i].leverage * rows, leverage, 0.1 * leverage) << i;
  }
}

TEST(Stream, RefusalsNameTheRow) {
  const auto message = [](const auto& call) -> std::string {
    try {
      call();
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  Stream stream(2, 1);
  Eigen::MatrixXd x = oracle::uniform(4, 2, 1);
  Eigen::MatrixXd y = affine(x);
  stream.add(x, y);
  y(3, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(message([&] { stream.add(x, y); }),
            "llmt::Stream: add(): outputs(3, 0) is nan, it must be finite and at most 1e150 in magnitude (row 7 of the "
            "stream; counted from 0)");
  EXPECT_EQ(stream.counts().rows, 4);
  y(3, 0) = 0.0;
  x(1, 1) = std::numeric_limits<double>::infinity();
  EXPECT_NE(message([&] { stream.add(x, y); }).find("inputs(1, 1) is inf"), std::string::npos);
  x(1, 1) = 0.0;
  EXPECT_NE(message([&] { stream.add(x, y, Eigen::Vector4d(1.0, 1.0, -1.0, 1.0)); }).find("weights(2, 0) is -1"),
            std::string::npos);
  x(2, 0) = 1e160;
  EXPECT_NE(message([&] { stream.add(x, y); }).find("inputs(2, 0) is 1e+160"), std::string::npos);
  x(2, 0) = 0.0;
  EXPECT_NE(message([&] { stream.add(x.leftCols(1), y); }).find("inputs is 4 x 1"), std::string::npos);
  EXPECT_NE(message([&] { stream.snapshot(llmt::ValidityChoice::gaussian); }).find("gaussian"), std::string::npos);
  EXPECT_NE(message([] { Stream(0, 1); }).find("0 inputs"), std::string::npos);
  EXPECT_NE(message([] { Stream(1, 1, {.significance = 0.0}); }).find("significance is 0"), std::string::npos);
  EXPECT_NE(message([] { Stream(1, 1, {.bins = 3}); }).find("bins is 3, it must be within 4 ... 256"),
            std::string::npos);
  EXPECT_NE(message([] { Stream(1, 1, {.max_leaves = -1}); }).find("max_leaves is -1"), std::string::npos);
  const double infinite = std::numeric_limits<double>::infinity();
  EXPECT_EQ(message([] { Stream(1, 1, {.min_variance_gain = -0.1}); }),
            "llmt::Stream: StreamOptions::min_variance_gain is -0.1, it must be finite and not negative");
  EXPECT_NE(message([&] { Stream(1, 1, {.min_variance_gain = infinite}); }).find("gain is inf"), std::string::npos);
  EXPECT_NE(message([] { Stream(1, 1, {.min_leaf_samples = -1}); }).find("min_leaf_samples is -1"), std::string::npos);
  EXPECT_NE(message([] { Stream(1, 1, {.bins = 257}); }).find("bins is 257"), std::string::npos);
  EXPECT_NE(message([] { Stream(1, 1, {.shrinkage = -1.0}); }).find("shrinkage is -1"), std::string::npos);
  EXPECT_NE(message([] { Stream(1, 1, {.reservoir_rows = -1}); }).find("reservoir_rows is -1"), std::string::npos);
  EXPECT_EQ(message([] { Stream(1, 1, {.min_variance_gain = 0.0, .bins = 256, .shrinkage = 0.05}); }), "");
}

}  // namespace
