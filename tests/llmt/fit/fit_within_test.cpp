#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "llmt/random.hpp"
#include "llmt/time_limit.hpp"

namespace llmt {
namespace {

std::shared_ptr<const TrainingData> waves(Eigen::Index rows) {
  Random random(3);
  auto data = std::make_shared<TrainingData>();
  data->inputs.resize(rows, 2);
  data->outputs.resize(rows, 1);
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (int j = 0; j < 2; ++j) data->inputs(i, j) = random.uniform(0.0, 1.0);
    data->outputs(i, 0) = std::sin(9.0 * data->inputs(i, 0)) * data->inputs(i, 1) + 0.01 * random.normal();
  }
  return data;
}

std::string text(const FitResult& fit) { return to_json(fit.model, fit.intervals); }

TEST(FitWithin, IsTheWholeFitWhereTheTimeIsEnough) {
  const auto data = waves(200);
  const TimedTree timed = fit_within(1e6, data);
  EXPECT_FALSE(timed.time.is_binding);
  EXPECT_EQ(timed.options.max_leaves, 0);
  EXPECT_EQ(text(timed.fit), text(fit(*data)));
  EXPECT_EQ(timed.fit.intervals.record().size_limit, 0);
  const TimedSum sum = fit_boosted_within(1e6, *data);
  EXPECT_FALSE(sum.time.is_binding);
  EXPECT_EQ(to_json(sum.result.model), to_json(fit_boosted(*data).model));
}

TEST(FitWithin, HasASizeThatMakesTheSameModelAgain) {
  const auto data = waves(200);
  const TimedTree timed = fit_within(1e-9, data);
  EXPECT_TRUE(timed.time.is_binding);
  EXPECT_GT(timed.time.taken, timed.time.seconds);
  EXPECT_EQ(timed.time.size, 8);
  EXPECT_EQ(timed.options.max_leaves, 8);
  EXPECT_EQ(timed.fit.intervals.record().size_limit, 8);
  EXPECT_EQ(text(timed.fit), text(fit(*data, timed.options)));
  EXPECT_NE(text(timed.fit), text(fit(*data)));
  const TimedSum sum = fit_boosted_within(1e-9, *data);
  EXPECT_TRUE(sum.time.is_binding);
  EXPECT_EQ(sum.options.max_rounds, 32);
  EXPECT_EQ(to_json(sum.result.model), to_json(fit_boosted(*data, sum.options).model));
  EXPECT_EQ(sum.result.model.record().size_limit, 32);
}

TEST(FitWithin, KeepsTheLimitInTheFile) {
  const auto data = waves(200);
  const TimedTree timed = fit_within(1e-9, data);
  const ModelWithIntervals loaded = from_json_with_intervals(text(timed.fit));
  EXPECT_EQ(loaded.intervals.record(), timed.fit.intervals.record());
  const TimedSum sum = fit_boosted_within(1e-9, *data);
  EXPECT_EQ(boosted_from_json(to_json(sum.result.model)).record().size_limit, 32);
  TrainingRecord negative = sum.result.model.record();
  negative.size_limit = -1;
  EXPECT_THROW(check_record(negative, sum.result.model.inputs(), 1), std::invalid_argument);
}

TEST(FitWithin, NeverExceedsWhatTheOptionsAllow) {
  const auto data = waves(200);
  FitOptions few;
  few.max_leaves = 5;
  const TimedTree timed = fit_within(1e-9, data, few);
  EXPECT_FALSE(timed.time.is_binding);
  EXPECT_EQ(timed.options.max_leaves, 5);
  const TimedSum sum = fit_boosted_within(1e-9, *data, {.max_rounds = 7});
  EXPECT_FALSE(sum.time.is_binding);
  EXPECT_EQ(sum.options.max_rounds, 7);
}

TEST(FitWithin, RefusesATimeThatIsNone) {
  const auto data = waves(50);
  for (const double seconds : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(fit_within(seconds, data), std::invalid_argument);
    EXPECT_THROW(fit_boosted_within(seconds, *data), std::invalid_argument);
  }
}

TEST(FitWithin, IsCancelledByTheCaller) {
  const auto data = waves(200);
  const Progress no = [](const ProgressReport&) { return false; };
  EXPECT_THROW(fit_within(10.0, data, {}, no), Cancelled);
  EXPECT_THROW(fit_boosted_within(10.0, *data, {}, no), Cancelled);
}

}  // namespace
}  // namespace llmt
