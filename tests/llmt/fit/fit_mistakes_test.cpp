// What fit() says of a caller's mistakes.
#include <gtest/gtest.h>

#include <limits>

#include "llmt/fit.hpp"
#include "oracles/oracles.hpp"
#include "oracles/samples.hpp"
#include "oracles/thrown.hpp"

namespace {

using oracle::as_grown;

using oracle::thrown;

// The crisp tree as it was grown.
TEST(Fit, CallersMistakesAreNamed) {
  const Eigen::MatrixXd x = oracle::uniform(10, 2, 15);
  const Eigen::MatrixXd y = x.col(0);
  EXPECT_EQ(thrown([&] { llmt::fit(x, y.topRows(9)); }), "llmt::fit: inputs has 10 rows, outputs has 9");
  EXPECT_EQ(thrown([&] { llmt::fit(Eigen::MatrixXd(0, 2), Eigen::MatrixXd(0, 1)); }),
            "llmt::fit: inputs is 0 x 2, at least one row and one column are needed");
  Eigen::MatrixXd bad = x;
  bad(3, 1) = std::numeric_limits<double>::infinity();
  EXPECT_EQ(thrown([&] { llmt::fit(bad, y); }),
            "llmt::fit: inputs(3, 1) is inf, it must be finite, or NaN where it is missing (rows and columns counted "
            "from 0)");
  bad(3, 1) = std::nan("");
  EXPECT_EQ(thrown([&] { llmt::fit(x, bad); }),
            "llmt::fit: outputs(3, 1) is nan, it must be finite (rows and columns counted from 0)");
  EXPECT_EQ(thrown([&] { llmt::fit(x, y, as_grown({.split_inputs = {2}})); }),
            "llmt::fit: split_inputs names column 2, there are 2");
  EXPECT_EQ(thrown([&] {
              llmt::fit(x, y, as_grown({.regression_inputs = {1, 1}}));
            }),
            "llmt::fit: regression_inputs names column 1 twice");
  EXPECT_EQ(thrown([&] { llmt::fit(x, y, {.folds = {.count = 1}}); }),
            "llmt::fit: folds.count is 1, it must be 0 or at least 2");
  EXPECT_EQ(thrown([&] { llmt::fit(Eigen::MatrixXd::Constant(10, 2, 1e-320), y); }),
            "llmt::fit: the largest magnitude in column 0 of inputs is 1e-320, it must be 0 or at least 1e-140");
  EXPECT_EQ(thrown([&] { llmt::fit(x, Eigen::MatrixXd::Constant(10, 1, 1e200)); }),
            "llmt::fit: a magnitude in outputs is 1e+200, it must be at most 1e150");
}

}  // namespace
