// The band about runs, against counts of fresh runs, and ranks by hand.
#include "llmt/run_band.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "llmt/dynamics/systems.hpp"
#include "llmt/fit_dynamic.hpp"

namespace {

using llmt::Series;

// y(t) = 0.5 y(t-1) + u(t-1), or, adding up, y(t) = y(t-1) + 0.5 (y(t-1) - y(t-2)) + u(t-1).
llmt::DynamicParts first_order(llmt::RunBand band, bool adds_up = false) {
  llmt::DynamicParts parts;
  parts.inputs = {{"u", "", -1.0, 1.0}};
  parts.outputs = {{"y", "", -2.0, 2.0}};
  parts.lags = adds_up ? llmt::Lags{{{1, 2}}, {{1}}, {true}} : llmt::Lags{{{1}}, {{1}}};
  parts.polynomial = {Eigen::VectorXd::Zero(2),
                      Eigen::VectorXd::Ones(2),
                      Eigen::VectorXd::Constant(2, -2.0),
                      Eigen::VectorXd::Constant(2, 2.0),
                      {{0}, {1}},
                      (Eigen::MatrixXd(1, 2) << 0.5, 1.0).finished()};
  parts.band = std::move(band);
  return parts;
}

std::vector<double> up_to(int count, double factor = 1.0) {
  std::vector<double> values;
  for (int k = 1; k <= count; ++k) values.push_back(factor * k);
  return values;
}

TEST(RunBand, IsARankOfTheErrorsAndALineBetweenThem) {
  const llmt::RunBand band{{{{1.0, up_to(19)}, {11.0, up_to(19, 2.0)}}}, 20};
  const llmt::DynamicModel model(first_order(band));
  EXPECT_EQ(llmt::half_width(model, 0, 1.0, 0.9), 18.0);  // ceil(0.9 * 20)
  EXPECT_EQ(llmt::half_width(model, 0, 1.0, 0.5), 10.0);
  EXPECT_DOUBLE_EQ(llmt::half_width(model, 0, 6.0, 0.9), 27.0);
  EXPECT_EQ(llmt::half_width(model, 0, 500.0, 0.9), 36.0);
  const llmt::DynamicModel grows(first_order(band, true));
  EXPECT_DOUBLE_EQ(llmt::half_width(grows, 0, 22.0, 0.9), 72.0);
  EXPECT_THROW(llmt::half_width(model, 0, 1.0, 0.99), std::invalid_argument);
  EXPECT_THROW(llmt::half_width(model, 1, 1.0, 0.9), std::invalid_argument);
  EXPECT_THROW(llmt::half_width(model, 0, 1.0, 1.0), std::invalid_argument);
  EXPECT_THROW(llmt::half_width(llmt::DynamicModel(first_order({})), 0, 1.0, 0.9), std::invalid_argument);
}

TEST(RunBand, EndsAtStopsAndBeginsBehindTheGivenRows) {
  llmt::DynamicParts parts = first_order({{{{1.0, up_to(19, 0.1)}}}, 20});
  parts.outputs[0].upper_stop = 2.0;
  const llmt::DynamicModel model(parts);
  const llmt::Run run = llmt::simulate(model, Eigen::MatrixXd::Ones(8, 1), Eigen::MatrixXd::Zero(2, 1));
  const llmt::Bounds bounds = llmt::run_bounds(model, run, 0.9);
  EXPECT_EQ(bounds.lower.topRows(2), run.outputs.topRows(2));
  EXPECT_DOUBLE_EQ(bounds.upper(2, 0), run.outputs(2, 0) + 1.8 > 2.0 ? 2.0 : run.outputs(2, 0) + 1.8);
  EXPECT_DOUBLE_EQ(bounds.lower(7, 0), run.outputs(7, 0) - 1.8);
  EXPECT_EQ(bounds.upper(7, 0), 2.0);
}

struct Coverage {
  double all = 0.0;
  double early = 0.0;  // of the first ten rows
};

// The share of measured values in the band over forty fresh runs.
Coverage coverage_of(const llmt::DynamicModel& model, const std::function<double(double, double, double)>& next,
                     Eigen::Index rows, double noise, double amplitude) {
  Coverage coverage;
  double count = 0.0;
  double early = 0.0;
  for (std::uint64_t seed = 1000; seed < 1040; ++seed) {
    const Series fresh = systems::record(rows + 50, seed, next, noise, amplitude);
    // The run begins in the middle of a motion.
    const Eigen::MatrixXd inputs = fresh.inputs.bottomRows(rows);
    const Eigen::MatrixXd outputs = fresh.outputs.bottomRows(rows);
    const llmt::Run run = llmt::simulate(model, inputs, outputs.topRows(model.memory()));
    const llmt::Bounds band = llmt::run_bounds(model, run, 0.9);
    for (Eigen::Index row = run.first; row < rows; ++row) {
      const bool inside = outputs(row, 0) >= band.lower(row, 0) && outputs(row, 0) <= band.upper(row, 0);
      coverage.all += inside;
      count += 1.0;
      if (row - run.first >= 10) continue;
      coverage.early += inside;
      early += 1.0;
    }
  }
  return {coverage.all / count, coverage.early / early};
}

TEST(RunBand, HoldsNineOfTenMeasuredValuesOfFreshRuns) {
  llmt::DynamicOptions options;
  options.lags = llmt::Lags{{{1, 2}}, {{1}}};
  const llmt::DynamicFit linear = llmt::fit_dynamic(systems::record(500, 31, systems::oscillator, 0.1), options);
  const Coverage of_linear = coverage_of(linear.model, systems::oscillator, 400, 0.1, 1.0);
  EXPECT_NEAR(of_linear.all, 0.9, 0.04);
  EXPECT_NEAR(of_linear.early, 0.9, 0.05);
  options.rest = llmt::RestLearner::none;
  const llmt::DynamicFit spring = llmt::fit_dynamic(systems::record(500, 32, systems::duffing, 0.1, 3.0), options);
  const Coverage of_spring = coverage_of(spring.model, systems::duffing, 400, 0.1, 3.0);
  EXPECT_NEAR(of_spring.all, 0.9, 0.06);
  // A linear model of the same spring errs far more, and its band says so.
  const llmt::DynamicFit short_record =
      llmt::fit_dynamic(systems::record(500, 32, systems::duffing, 0.0, 3.0), options);
  EXPECT_LT(llmt::half_width(short_record.model, 0, 100.0, 0.9), 0.2 * llmt::half_width(spring.model, 0, 100.0, 0.9));
}

TEST(RunBand, GrowsWithTheTimeWhereAnOutputAddsUp) {
  const auto slide = [](double y1, double y2, double u1) { return y1 + 0.9 * (y1 - y2) + 0.1 * u1; };
  llmt::DynamicOptions options;
  options.rest = llmt::RestLearner::none;
  options.lags = llmt::Lags{{{1, 2}}, {{1}}, {true}};
  const llmt::DynamicFit fit = llmt::fit_dynamic(systems::record(400, 33, slide, 0.02), options);
  const double late = llmt::half_width(fit.model, 0, 90.0, 0.9);
  EXPECT_GT(late, 3.0 * llmt::half_width(fit.model, 0, 1.0, 0.9));
  EXPECT_GT(llmt::half_width(fit.model, 0, 400.0, 0.9), 3.0 * late);
  const Coverage coverage = coverage_of(fit.model, slide, 400, 0.02, 1.0);
  EXPECT_GT(coverage.all, 0.8);
}

TEST(RunBand, HeldOutRunsAreThoseOfModelsThatHaveNotSeenTheRows) {
  const Series series = systems::record(200, 34, systems::oscillator);
  llmt::DynamicOptions options;
  options.lags = llmt::Lags{{{1, 2}}, {{1}}};
  options.rest = llmt::RestLearner::none;
  const llmt::DynamicFit exact = llmt::fit_dynamic(series, options);
  ASSERT_EQ(exact.held_out.rows(), 200);
  Eigen::Index runs = 0;
  for (Eigen::Index row = 0; row < 200; ++row) {
    if (std::isnan(exact.held_out(row, 0))) continue;
    ++runs;
    EXPECT_NEAR(exact.held_out(row, 0), series.outputs(row, 0), 1e-8);
  }
  EXPECT_EQ(runs, 200 - 4 * 2);  // four stretches, each begun by two rows
  // A stretch that follows another law is not known to the model that runs over it.
  Series torn = series;
  torn.outputs.middleRows(50, 50) *= -1.0;
  const llmt::DynamicFit other = llmt::fit_dynamic(torn, options);
  const double inside = (other.held_out - torn.outputs).middleRows(60, 30).norm();
  EXPECT_GT(inside, (other.held_out - torn.outputs).middleRows(110, 30).norm());
  EXPECT_EQ(exact.model.parts().band.longest, 48);
}

TEST(RunBand, FilesHaveItAndFilesWithoutItAreRead) {
  const llmt::RunBand band{{{{1.0, up_to(19)}, {11.5, up_to(30, 2.0)}}}, 20};
  const std::string text = llmt::to_json(llmt::DynamicModel(first_order(band)));
  const llmt::DynamicModel again = llmt::dynamic_from_json(text);
  EXPECT_EQ(llmt::to_json(again), text);
  EXPECT_EQ(llmt::half_width(again, 0, 11.5, 0.9), 56.0);
  const std::string without = llmt::to_json(llmt::DynamicModel(first_order({})));
  EXPECT_EQ(without.find("held_out_errors"), std::string::npos);
  EXPECT_TRUE(llmt::dynamic_from_json(without).parts().band.outputs.empty());
  const std::vector<std::array<std::string, 3>> cases = {
      {"\"longest\": 20", "\"longest\": 0", "longest held-out run has 0 rows"},
      {"\"longest\": 20", "\"longest\": \"x\"", "/held_out_errors/longest"},
      {"\"rows\": 11.5", "\"rows\": 0.5", "do not ascend in rows"},
      {"\"rows\": 11.5", "\"rows\": null", "/held_out_errors/outputs/0/1/rows"},
      {"60.0", "-1.0", "not finite and ascending"},
  };
  for (const auto& [part, other, message] : cases) {
    std::string changed = text;
    ASSERT_NE(changed.find(part), std::string::npos) << part;
    changed.replace(changed.find(part), part.size(), other);
    try {
      llmt::dynamic_from_json(changed, "m.json");
      ADD_FAILURE() << other;
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find(message), std::string::npos) << error.what();
    }
  }
  EXPECT_THROW(llmt::DynamicModel(first_order({{{}}, 20})), std::invalid_argument);
  EXPECT_THROW(llmt::DynamicModel(first_order({{{{1.0, up_to(19)}}, {{1.0, up_to(19)}}}, 20})), std::invalid_argument);
}

}  // namespace
