// The rows that a fit held out are those of its intervals.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "llmt/fit.hpp"
#include "llmt/random.hpp"

namespace {

// Residuals of the folds' models on the rows that the summary names are those that the fit kept, copies counted once.
TEST(HeldOutRows, AreThoseOfTheIntervals) {
  llmt::Random random(3);
  constexpr int rows = 120;
  Eigen::MatrixXd inputs(rows, 2);
  Eigen::MatrixXd outputs(rows, 1);
  for (int i = 0; i < rows; ++i) {
    inputs.row(i) << random.uniform(), random.uniform();
    outputs(i, 0) = inputs(i, 0) * inputs(i, 1) + 0.01 * random.normal();
  }
  for (const int i : {5, 17, 60}) {  // copies, and a repeat
    inputs.row(i + 1) = inputs.row(i);
    outputs.row(i + 1) = outputs.row(i);
  }
  inputs.row(90) = inputs.row(5);
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(rows);
  weights(40) = 0.0;
  const llmt::FitResult result = llmt::fit({.inputs = inputs, .outputs = outputs, .weights = weights});
  const std::vector<std::vector<Eigen::Index>>& held_out = result.summary.held_out;
  ASSERT_EQ(held_out.size(), result.intervals.models().size());
  std::size_t covered = 0;
  for (std::size_t f = 0; f < held_out.size(); ++f) {
    covered += held_out[f].size();
    const Eigen::MatrixXd predicted = result.intervals.models()[f].predict(inputs(held_out[f], Eigen::all));
    Eigen::VectorXd found = (outputs(held_out[f], Eigen::all) - predicted).cwiseAbs().col(0);
    const llmt::HeldOutPart& part = result.intervals.parts()[f];
    const Eigen::MatrixXd x = inputs(held_out[f], Eigen::all);
    for (Eigen::Index i = 0; i < found.size() && !part.spreads.empty(); ++i) {
      found(i) /= llmt::spread_at(part.spreads[0], x, i, predicted(i, 0));
    }
    const auto kept = part.residuals.col(0);
    for (const double residual : kept) EXPECT_NE(std::ranges::find(found, residual), found.end());
    for (const double residual : found) EXPECT_NE(std::ranges::find(kept, residual), kept.end());
    EXPECT_EQ(std::ranges::count(held_out[f], 40), 0);
  }
  EXPECT_EQ(covered, rows - 1);
}

TEST(HeldOutRows, AreNoneWithoutFolds) {
  llmt::FitOptions options;
  options.folds.count = 0;
  const Eigen::MatrixXd values = Eigen::VectorXd::LinSpaced(9, 0.0, 1.0);
  EXPECT_TRUE(llmt::fit(values, values, options).summary.held_out.empty());
}

}  // namespace
