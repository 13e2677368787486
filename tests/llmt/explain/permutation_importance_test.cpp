// Permutation importance against its closed form on an affine model.
#include "llmt/permutation_importance.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "llmt/fit.hpp"
#include "llmt/random.hpp"

namespace {

struct NoisyRows {
  Eigen::MatrixXd inputs;
  Eigen::MatrixXd outputs;
};

// y = 3 x0 + x1 + noise of 0.5; x2 is not there.
NoisyRows drawn(Eigen::Index count) {
  llmt::Random random(5);
  NoisyRows rows{Eigen::MatrixXd(count, 3), Eigen::MatrixXd(count, 1)};
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = 0; j < 3; ++j) rows.inputs(i, j) = random.normal();
    rows.outputs(i, 0) = 3.0 * rows.inputs(i, 0) + rows.inputs(i, 1) + 0.5 * random.normal();
  }
  return rows;
}

llmt::PermutationImportance importance(const NoisyRows& rows, const llmt::PermutationOptions& options = {}) {
  const llmt::FitResult fitted = llmt::fit(rows.inputs, rows.outputs, {.max_leaves = 1});
  return llmt::permutation_importance(fitted.intervals.models(), rows.inputs, rows.outputs, fitted.summary.held_out, {},
                                      options);
}

TEST(PermutationImportance, OfAnAffineModelIsThatOfTheSlopes) {
  const NoisyRows rows = drawn(1500);
  const llmt::PermutationImportance found = importance(rows);
  EXPECT_EQ(found.rows, 1500);
  EXPECT_NEAR(found.rmse(0), 0.5, 0.03);
  // A permuted input adds twice the variance of its part: sqrt(0.25 + 2 b^2) - 0.5.
  EXPECT_NEAR(found.increase(0, 0), std::sqrt(0.25 + 18.0) - 0.5, 0.2);
  EXPECT_NEAR(found.increase(0, 1), std::sqrt(0.25 + 2.0) - 0.5, 0.1);
  EXPECT_NEAR(found.increase(0, 2), 0.0, 0.01);
  for (Eigen::Index j = 0; j < 2; ++j) EXPECT_GT(found.increase(0, j), 10.0 * found.standard_error(0, j));
  // The error of the estimates is of the size that is stated: of 1500 rows (here of a normal distribution) about 2 %.
  EXPECT_NEAR(found.standard_error(0, 1), 0.03, 0.02);
}

TEST(PermutationImportance, DoesNotDependOnThreadsAndLooksAtFewRows) {
  const NoisyRows rows = drawn(400);
  const llmt::PermutationImportance one = importance(rows, {.most_rows = 100, .max_threads = 1});
  const llmt::PermutationImportance two = importance(rows, {.most_rows = 100, .max_threads = 2});
  EXPECT_EQ(one.rows, 100);
  EXPECT_EQ(one.increase, two.increase);
  EXPECT_EQ(one.standard_error, two.standard_error);
  EXPECT_NEAR(one.increase(0, 0), std::sqrt(0.25 + 18.0) - 0.5, 0.8);
}

TEST(PermutationImportance, ARowOfWeightZeroDoesNotCount) {
  NoisyRows rows = drawn(200);
  const llmt::FitResult fitted = llmt::fit(rows.inputs, rows.outputs, {.max_leaves = 1});
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(200);
  weights(7) = 0.0;
  rows.outputs(7, 0) = 1e6;
  const llmt::PermutationImportance found = llmt::permutation_importance(
      fitted.intervals.models(), rows.inputs, rows.outputs, fitted.summary.held_out, weights);
  EXPECT_NEAR(found.rmse(0), 0.5, 0.1);
}

TEST(PermutationImportance, ArgumentsAreChecked) {
  const NoisyRows rows = drawn(60);
  const llmt::FitResult fitted = llmt::fit(rows.inputs, rows.outputs, {.max_leaves = 1});
  const auto& models = fitted.intervals.models();
  const auto& held_out = fitted.summary.held_out;
  EXPECT_THROW(llmt::permutation_importance({}, rows.inputs, rows.outputs, {}), std::invalid_argument);
  EXPECT_THROW(llmt::permutation_importance(models, rows.inputs, rows.outputs, {}), std::invalid_argument);
  EXPECT_THROW(llmt::permutation_importance(models, rows.inputs.topRows(5), rows.outputs.topRows(5), held_out),
               std::invalid_argument);
  EXPECT_THROW(llmt::permutation_importance(models, rows.inputs, rows.outputs, held_out, Eigen::VectorXd::Ones(3)),
               std::invalid_argument);
  EXPECT_THROW(llmt::permutation_importance(models, rows.inputs, rows.outputs, held_out, {}, {.repeats = 0}),
               std::invalid_argument);
  EXPECT_THROW(llmt::permutation_importance(models, rows.inputs, rows.outputs, held_out, {}, {.most_rows = 9}),
               std::invalid_argument);
}

}  // namespace
