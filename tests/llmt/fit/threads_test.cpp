// Callers on several threads at once. Built with ThreadSanitizer these tests find what is written and read at once.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "llmt/boosted.hpp"
#include "llmt/boosted_explain.hpp"
#include "llmt/csv.hpp"
#include "llmt/explain.hpp"
#include "llmt/fit.hpp"
#include "llmt/stream.hpp"
#include "oracles/oracles.hpp"

namespace {

void at_once(int threads, const std::function<void(int)>& body) {
  std::vector<std::thread> all;
  for (int k = 0; k < threads; ++k) all.emplace_back(body, k);
  for (std::thread& each : all) each.join();
}

TEST(Threads, AskOneModelAtOnce) {
  const Eigen::MatrixXd x = oracle::uniform(300, 3, 1);
  const llmt::FitResult fitted = llmt::fit(x, oracle::curved(x, 0.1), {.max_leaves = 8});
  const Eigen::MatrixXd query = 1.5 * oracle::uniform(600, 3, 2);
  const Eigen::MatrixXd expected = fitted.model.predict(query);
  at_once(4, [&](int k) {
    EXPECT_EQ(fitted.model.predict(query, 1 + k % 2), expected);
    EXPECT_EQ(fitted.model.predict(query.topRows(5)), expected.topRows(5));
    EXPECT_EQ(fitted.model.extrapolation(query).size(), 600U);
    EXPECT_EQ(fitted.intervals.predict(query, 0.9).lower.rows(), 600);
    EXPECT_EQ(fitted.model.leaf_of(query).rows(), 600);
    EXPECT_TRUE(llmt::attribute(fitted.model, query.row(k)).contributions.allFinite());
  });
}

TEST(Threads, FitAtOnce) {
  const Eigen::MatrixXd x = oracle::uniform(200, 3, 3);
  const Eigen::MatrixXd y = oracle::curved(x, 0.1);
  std::vector<std::string> models(3);
  at_once(3, [&](int k) { models[k] = to_json(llmt::fit(x, y, {.max_leaves = 6, .max_threads = 2}).model); });
  EXPECT_EQ(models[0], models[1]);
  EXPECT_EQ(models[0], models[2]);
}

TEST(Threads, AskOneSumOfTreesAtOnce) {
  const Eigen::MatrixXd x = oracle::uniform(200, 3, 11);
  const llmt::BoostedModel model =
      llmt::fit_boosted({.inputs = x, .outputs = oracle::curved(x, 0.1)}, {.max_rounds = 20}).model;
  const Eigen::MatrixXd query = 1.5 * oracle::uniform(300, 3, 12);
  const Eigen::MatrixXd expected = model.predict(query);
  const Eigen::MatrixXd why = llmt::attribute_rows(model, query.topRows(5), x.topRows(5)).contributions[0];
  const std::string text = to_json(model);
  at_once(4, [&](int k) {
    EXPECT_EQ(model.predict(query, 1 + k % 2), expected);
    EXPECT_EQ(llmt::attribute_rows(model, query.topRows(5), x.topRows(5)).contributions[0], why);
    EXPECT_EQ(to_json(model), text);
  });
}

TEST(Threads, AskOneStreamAtOnce) {
  const Eigen::MatrixXd x = oracle::uniform(1500, 2, 13);
  llmt::Stream stream(2, 1);
  stream.add(x, oracle::curved(x, 0.05));
  const std::string state = to_json(stream);
  const std::string model = to_json(stream.snapshot());
  const Eigen::MatrixXd expected = stream.predict(x);
  at_once(4, [&](int) {
    EXPECT_EQ(to_json(stream), state);
    EXPECT_EQ(to_json(stream.snapshot()), model);
    EXPECT_EQ(stream.predict(x), expected);
    EXPECT_EQ(stream.counts().rows, 1500);
    EXPECT_TRUE(stream.prequential_rmse().allFinite() && stream.recent_rmse().allFinite());
  });
}

// Blocks that are alike may come in any order.
TEST(Threads, LearnFromOneStreamOneAfterTheOther) {
  const Eigen::MatrixXd x = oracle::uniform(300, 2, 14);
  const Eigen::MatrixXd y = oracle::curved(x, 0.05);
  llmt::Stream shared(2, 1);
  std::mutex mutex;
  at_once(4, [&](int k) {
    for (int block = 0; block < 3; ++block) {
      const std::lock_guard lock(mutex);
      shared.add(x, y);
      if (k > 0) continue;
      EXPECT_TRUE(shared.snapshot().predict(x).allFinite());
    }
  });
  llmt::Stream alone(2, 1);
  for (int block = 0; block < 12; ++block) alone.add(x, y);
  EXPECT_EQ(to_json(shared), to_json(alone));
}

TEST(Threads, LearnFromStreamsAtOnce) {
  const Eigen::MatrixXd x = oracle::uniform(3000, 2, 4);
  const Eigen::MatrixXd y = oracle::curved(x, 0.05);
  std::vector<std::string> models(3);
  at_once(3, [&](int k) {
    llmt::Stream stream(2, 1);
    stream.add(x, y);
    models[k] = to_json(stream.snapshot());
  });
  EXPECT_EQ(models[0], models[1]);
  EXPECT_EQ(models[0], models[2]);
}

TEST(Threads, ReadOneTableAtOnce) {
  std::string text = "a,b\n";
  for (int row = 0; row < 5000; ++row) text += std::to_string(row) + ",0.5\n";
  const llmt::Csv csv = llmt::Csv::parse(text, "t.csv");
  const Eigen::MatrixXd expected = csv.numbers(csv.columns(), 1);
  at_once(3, [&](int) { EXPECT_EQ(csv.numbers(csv.columns()), expected); });
}

}  // namespace
