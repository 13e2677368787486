// What stands for a missing value where leaves overlap, and how much a row counts in which something is missing.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "fit/missing_weights.hpp"
#include "llmt/fit.hpp"
#include "oracles/oracles.hpp"
#include "oracles/samples.hpp"

namespace {

// Mean of the model over the values that an input has in the rows, at a point.
double mean_over(const llmt::Model& model, const Eigen::MatrixXd& rows, Eigen::RowVectorXd point, Eigen::Index input) {
  Eigen::MatrixXd points = point.replicate(rows.rows(), 1);
  points.col(input) = rows.col(input);
  return model.predict(points).mean();
}

TEST(Missing, BlendOfCompleteRowsPredictsItsMeanOverTheMissingValue) {
  const Eigen::MatrixXd x = oracle::uniform(1500, 3, 7);
  Eigen::MatrixXd y(x.rows(), 1);
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    y(i, 0) = std::sin(3.0 * x(i, 0)) * (1.0 + x(i, 1)) + 2.0 * std::abs(x(i, 1)) + x(i, 2);
  }
  const llmt::Model model = llmt::fit(x, y, {.validity = llmt::ValidityChoice::blend}).model;
  ASSERT_GT(model.partitions()[0].num_leaves(), 5);
  const Eigen::MatrixXd asked = oracle::uniform(15, 3, 8);
  for (Eigen::Index input = 0; input < 3; ++input) {
    double squares = 0.0;
    double spread = 0.0;
    for (Eigen::Index i = 0; i < asked.rows(); ++i) {
      Eigen::RowVectorXd point = asked.row(i);
      const double expected = mean_over(model, x, point, input);
      spread += std::pow(model.predict(point)(0, 0) - expected, 2);
      point(input) = oracle::missing;
      squares += std::pow(model.predict(point)(0, 0) - expected, 2);
    }
    EXPECT_LT(std::sqrt(squares / spread), 0.1) << "input " << input;
  }
}

TEST(Missing, RowsCountByHowMuchWhatIsMissingScattersTheOutput) {
  Eigen::MatrixXd x = oracle::uniform(1000, 3, 9);
  Eigen::MatrixXd y = 10.0 * x.col(0) + 0.5 * x.col(1);
  y += 0.5 * oracle::uniform(1000, 1, 10);
  for (Eigen::Index i = 0; i < 300; ++i) x(i, i / 100) = oracle::missing;
  const llmt::FitOptions options;
  const std::vector<int> columns = {0, 1, 2};
  const llmt::Table table{x, y, Eigen::VectorXd::Ones(1000), {0, 0, 0}, columns, columns};
  std::vector<int> rows(1000);
  std::iota(rows.begin(), rows.end(), 0);
  llmt::Work uncounted;
  const Eigen::VectorXd weights = llmt::weights_by_missing(llmt::training_rows(table, rows), options, uncounted);
  // The variance that x_0 adds is 33, of which 100 / 140 counts; the rest raises that of complete rows to about 1.
  EXPECT_LT(weights.head(100).maxCoeff(), 0.1);
  EXPECT_GT(weights.segment(100, 100).minCoeff(), 0.3);
  EXPECT_GT(weights.segment(200, 100).minCoeff(), 0.8);
  EXPECT_TRUE((weights.tail(700).array() == 1.0).all());
}

}  // namespace
