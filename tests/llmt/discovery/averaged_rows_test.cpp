// Logs with more rows than a search can use.
#include "discovery/answer/averaged_rows.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "llmt/discovery/simulation.hpp"
#include "noise.hpp"

namespace averaged_rows_test {
namespace {

using namespace llmt::discovery;

constexpr Eigen::Index rows = 12000;
constexpr Eigen::Index most = 3000;

// x of 0.5 and 0.8 Hz, taken at 1 kHz in two runs; y = x + x^2, of which the simulation has x.
struct Log {
  Inputs inputs{{"x"}, Eigen::MatrixXd(rows, 1)};
  MeasuredOutputs measured{{"y"}, Eigen::MatrixXd(rows, 1)};
  Simulation simulation;

  Log() {
    Noise random(1);
    inputs.instants = Eigen::VectorXd(rows);
    for (Eigen::Index i = 0; i < rows; ++i) {
      const double t = 1e-3 * static_cast<double>(i);
      inputs.instants(i) = t;
      inputs.runs.push_back(i < 5001 ? 0 : 1);
      inputs.values(i, 0) = std::sin(3.1 * t) + 0.5 * std::sin(5.0 * t) + 0.01 * random.normal();
      const double x = inputs.values(i, 0);
      measured.values(i, 0) = x + x * x + 0.1 * random.normal();
    }
    simulation = tabulated(inputs.values, {"y"});
  }
};

TEST(AveragedRows, AreMeansWithinARun) {
  const Log log;
  const std::optional<AveragedRows> few = averaged(Recording(log.inputs), log.measured, {.largest_sample = 50}, most);
  ASSERT_TRUE(few);
  EXPECT_EQ(few->blocks.size(), 1250 + 1749);  // of four rows or five
  EXPECT_EQ(std::ssize(few->blocks.rows()), rows);
  for (const Eigen::Index b : {Eigen::Index{0}, Eigen::Index{1249}, Eigen::Index{1250}, few->blocks.size() - 1}) {
    const auto own = few->blocks.rows_of(b);
    double mean = 0.0;
    for (const Eigen::Index row : own) {
      EXPECT_EQ(log.inputs.runs[row], few->recording.inputs().runs[b]);
      mean += log.measured.values(row, 0) / static_cast<double>(own.size());
    }
    EXPECT_NEAR(few->measured.values(b, 0), mean, 1e-12);
    EXPECT_NEAR(few->recording.inputs().instants(b),
                0.5 * (log.inputs.instants(own.front()) + log.inputs.instants(own.back())), 1e-9);
  }
}

TEST(AveragedRows, AreNotMadeWhereInputsChangeFastOrRowsAreFew) {
  Log log;
  const auto is_averaged = [&](Eigen::Index fewest) {
    return averaged(Recording(log.inputs), log.measured, {.largest_sample = 50}, fewest).has_value();
  };
  EXPECT_TRUE(is_averaged(most));
  EXPECT_FALSE(is_averaged(rows / 2 + 1));
  log.inputs.noise = Eigen::VectorXd::Constant(1, 0.01);
  const std::optional<AveragedRows> few = averaged(Recording(log.inputs), log.measured, {.largest_sample = 50}, most);
  ASSERT_TRUE(few);
  const double length = static_cast<double>(rows) / static_cast<double>(few->blocks.size());
  EXPECT_NEAR(few->recording.inputs().noise(0), 0.01 / std::sqrt(std::floor(length)), 1e-12);  // that of a mean
  log.inputs.noise = {};
  const Eigen::ArrayXd fast = (2.0 * 3.14159 * 40.0 * log.inputs.instants).array().sin();
  log.inputs.values.col(0) = fast.matrix();
  EXPECT_FALSE(is_averaged(most));
  log.inputs.instants = {};
  EXPECT_FALSE(is_averaged(most));
}

TEST(AveragedRows, WhatWasFoundIsToldOfAllRows) {
  const Log log;
  const std::vector<ModelTerm> terms = standard_terms(log.inputs);
  const std::optional<AveragedRows> few = averaged(Recording(log.inputs), log.measured, {.largest_sample = 50}, most);
  ASSERT_TRUE(few);
  const Simulation of_means = averaged(log.simulation, log.inputs, few->blocks);
  const Missing of_blocks =
      find_missing(of_means, few->recording.inputs(), few->measured, terms, {.largest_sample = 1000});
  ASSERT_EQ(of_blocks.found.size(), 1u);
  EXPECT_EQ(of_blocks.found[0].family, "square");
  EXPECT_NEAR(of_blocks.found[0].coefficients(0), 1.0, 0.01);
  const Missing missing = of_all_rows(of_blocks, *few, log.simulation, terms, Recording(log.inputs));
  EXPECT_EQ(missing.held_out.size(), missing.held_out_samples.size());
  EXPECT_EQ(missing.searched.size() + missing.held_out.size(), static_cast<std::size_t>(rows));
  std::vector<Eigen::Index> all = missing.searched;
  all.insert(all.end(), missing.held_out.begin(), missing.held_out.end());
  std::ranges::sort(all);
  for (Eigen::Index i = 0; i < rows; ++i) ASSERT_EQ(all[i], i);
  EXPECT_NEAR(missing.time.step, 1e-3, 1e-6);
  EXPECT_EQ(missing.time.rows_per_sample, 4 * of_blocks.time.rows_per_sample);
  // Nothing of the simulation is free, so `before` is the simulation.
  const Eigen::ArrayXd x = log.inputs.values.array();
  EXPECT_LT((missing.before.array() - x).abs().maxCoeff(), 1e-6);
  const double coefficient = of_blocks.found[0].coefficients(0);
  EXPECT_LT((missing.corrected.array() - (x + coefficient * x.square())).abs().maxCoeff(), 1e-9);
}

}  // namespace
}  // namespace averaged_rows_test
