// Default fits on public data with given splits (the target is the last column; 1 = test row).
#include <gtest/gtest.h>

#include "llmt/csv.hpp"
#include "llmt/fit.hpp"

namespace {

class RegressionSet : public testing::TestWithParam<const char*> {};

TEST_P(RegressionSet, DefaultTreeIsAQuarterBelowLeastSquaresOnEverySplit) {
  const std::string path = std::string(LLMT_DATA_DIR) + "/regression/" + GetParam();
  const llmt::Csv data = llmt::Csv::read(path + ".csv");
  const llmt::Csv splits = llmt::Csv::read(path + ".splits.csv");
  const Eigen::MatrixXd all = data.numbers(data.columns());
  const Eigen::MatrixXd is_test = splits.numbers(splits.columns());
  for (Eigen::Index split = 0; split < is_test.cols(); ++split) {
    std::vector<Eigen::Index> train;
    std::vector<Eigen::Index> test;
    for (Eigen::Index row = 0; row < all.rows(); ++row) {
      (is_test(row, split) > 0.5 ? test : train).push_back(row);
    }
    const Eigen::MatrixXd x = all(train, Eigen::all).leftCols(all.cols() - 1);
    const Eigen::MatrixXd y = all(train, Eigen::all).rightCols(1);
    const Eigen::MatrixXd x_test = all(test, Eigen::all).leftCols(all.cols() - 1);
    const Eigen::MatrixXd y_test = all(test, Eigen::all).rightCols(1);
    const llmt::Model model = llmt::fit(x, y).model;
    EXPECT_LT(llmt::rmse(model.predict(x_test), y_test)(0),
              0.75 * llmt::rmse(model.prefix(1).predict(x_test), y_test)(0))
        << split;
  }
}

INSTANTIATE_TEST_SUITE_P(Public, RegressionSet, testing::Values("airfoil", "concrete", "yacht"),
                         [](const testing::TestParamInfo<const char*>& set) { return std::string(set.param); });

}  // namespace
