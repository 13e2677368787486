// How much each sample counts.
#include "discovery/answer/errors_of_inputs.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "discovery/recording/recording.hpp"
#include "filtered_log.hpp"
#include "llmt/random.hpp"

namespace sample_weights_test {
namespace {

using namespace log_test;

TEST(VarianceBeside, IsThatOfDrawnErrors) {
  constexpr Eigen::Index n = 20000;
  constexpr double variance = 0.09;
  llmt::Random random(3);
  Eigen::VectorXd known(n);
  Eigen::VectorXd residuals(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    known(i) = i % 4 == 0 ? 4.0 : 0.01;
    residuals(i) = std::sqrt(variance + known(i)) * random.normal();
  }
  EXPECT_NEAR(variance_beside(residuals, known, 1e-6), variance, 0.05 * variance);
  EXPECT_EQ(variance_beside(residuals, known, 1.0), 1.0);  // no less than what is known
  EXPECT_NEAR(variance_beside(residuals, Eigen::VectorXd::Zero(n), 1e-6), residuals.squaredNorm() / n, 1e-9);
}

// The filter, of rows six times as near: a peak that rows hardly resolve has errors, a slow signal none.
TEST(ErrorsOfSteps, AreThoseOfAFilterOfFinerRows) {
  constexpr Eigen::Index finer = 16;
  constexpr Eigen::Index n = 400;
  const auto inputs_of = [](Eigen::Index count) {
    Inputs inputs{{"x"}, Eigen::VectorXd::LinSpaced(count, -1.0, 1.0)};
    inputs.instants = Eigen::VectorXd::LinSpaced(count, 0.0, 10.0);
    inputs.cutoff = 2.6;
    return inputs;
  };
  const Recording coarse(inputs_of(n + 1));
  const Recording fine(inputs_of(finer * n + 1));
  const auto error = [&](const std::function<double(double)>& signal) {
    const Eigen::MatrixXd exact = fine.as_measured(fine.inputs().values.col(0).unaryExpr(signal));
    const Eigen::MatrixXd values = coarse.inputs().values.col(0).unaryExpr(signal);
    const Eigen::MatrixXd filtered = coarse.as_measured(values);
    double worst = 0.0;
    for (Eigen::Index i = 0; i <= n; ++i) worst = std::max(worst, std::abs(filtered(i, 0) - exact(finer * i, 0)));
    return std::pair(worst, std::sqrt(coarse.squared_errors_of_steps(values).maxCoeff()));
  };
  const auto [narrow, said] = error([](double x) { return std::exp(-std::abs((x - 0.1137) / 0.004)); });
  EXPECT_GT(said, 0.3 * narrow);
  EXPECT_LT(said, 3.0 * narrow);
  const auto [wide, said_of_wide] = error([](double x) { return std::exp(-std::pow((x - 0.1137) / 0.1, 2.0)); });
  EXPECT_LT(wide, 0.01 * narrow);
  EXPECT_LT(said_of_wide, 0.01 * said);
}

// A peak of friction that a reversal passes between two rows. Counted like the others, its rows hide the mass.
TEST(SampleWeights, ReversalsBetweenRowsDoNotHideWhatIsMissing) {
  const auto peak = [](const Eigen::Vector3d& x) {
    const double sign = x(1) > 0.0 ? 1.0 : -1.0;
    return 6.0 * sign * std::exp(-std::pow(x(1) / 0.02, 2.0));
  };
  const Model model{.dry = 1.0};
  LogRows rows = rows_of_log(1, model, 0.02, [&](double t) {
    const Eigen::Vector3d x = motion(t);
    return model.torque(x) + peak(x) + 0.05 * x(0) * x(0);
  });
  for (Eigen::Index i = 0; i < rows.simulated.rows(); ++i) {
    rows.simulated(i, 0) += peak(rows.inputs.values.row(i).transpose());
  }
  const Missing missing = missing_from(rows);
  ASSERT_EQ(missing.found.size(), 1u) << to_string(missing.answer);
  EXPECT_EQ(missing.found[0].family + " " + missing.found[0].location, "square q");
  EXPECT_NEAR(missing.found[0].coefficients(0), 0.05, 0.01);
  ASSERT_EQ(missing.weights.rows(), rows.simulated.rows());
  EXPECT_LT(missing.weights.minCoeff(), 0.2 * missing.weights.maxCoeff());
}

}  // namespace
}  // namespace sample_weights_test
