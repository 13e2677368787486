// Callers on several threads at once. Built with ThreadSanitizer these tests find what is written and read at once.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <functional>
#include <string>
#include <thread>
#include <vector>

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
