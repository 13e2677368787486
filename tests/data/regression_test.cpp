// Default fits on the first of the given splits of public data (the target is the last column; 1 = test row).
#include <gtest/gtest.h>

#include <ostream>
#include <string>
#include <vector>

#include "llmt/csv.hpp"
#include "llmt/fit.hpp"

namespace {

struct Set {
  const char* name;
  double bound;  // of the test RMSE, in the target's unit
};

void PrintTo(const Set& set, std::ostream* to) { *to << set.name; }

class RegressionSet : public testing::TestWithParam<Set> {};

TEST_P(RegressionSet, DefaultFitIsBelowTheBoundAndAQuarterBelowLeastSquares) {
  const std::string path = std::string(LLMT_DATA_DIR "/regression/") + GetParam().name;
  const llmt::Csv data = llmt::Csv::read(path + ".csv");
  const llmt::Csv splits = llmt::Csv::read(path + ".splits.csv");
  const Eigen::MatrixXd all = data.numbers(data.columns());
  const Eigen::VectorXd is_test = splits.numbers(splits.columns().front());
  std::vector<Eigen::Index> train;
  std::vector<Eigen::Index> test;
  for (Eigen::Index row = 0; row < all.rows(); ++row) {
    (is_test(row) > 0.5 ? test : train).push_back(row);
  }
  const Eigen::MatrixXd x = all(train, Eigen::all).leftCols(all.cols() - 1);
  const Eigen::MatrixXd y = all(train, Eigen::all).rightCols(1);
  const Eigen::MatrixXd x_test = all(test, Eigen::all).leftCols(all.cols() - 1);
  const Eigen::MatrixXd y_test = all(test, Eigen::all).rightCols(1);
  const double rmse = llmt::rmse(llmt::fit(x, y).model.predict(x_test), y_test)(0);
  RecordProperty("rmse", std::to_string(rmse));
  EXPECT_LE(rmse, GetParam().bound);
  // One leaf is least squares.
  llmt::FitOptions one_leaf;
  one_leaf.max_leaves = 1;
  one_leaf.validity = llmt::ValidityChoice::crisp;
  one_leaf.folds.count = 0;
  EXPECT_LT(rmse, 0.75 * llmt::rmse(llmt::fit(x, y, one_leaf).model.predict(x_test), y_test)(0));
}

INSTANTIATE_TEST_SUITE_P(Public, RegressionSet,
                         testing::Values(Set{"yacht", 1.0}, Set{"kin8nm", 0.095}, Set{"california", 5.2e4}),
                         [](const testing::TestParamInfo<Set>& set) { return std::string(set.param.name); });

}  // namespace
