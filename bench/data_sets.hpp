/// \file
/// Data sets with given splits: NAME.csv holds the rows, its last column is the output. Every column of
/// NAME.splits.csv is a split with one number per row: 1 for a test row, 0 for a training row.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace bench {

/// Rows to learn from, and rows to judge the model by. Test outputs are without noise where the truth is known.
struct Trial {
  Eigen::MatrixXd train_inputs;
  Eigen::VectorXd train_output;
  Eigen::MatrixXd test_inputs;
  Eigen::VectorXd test_output;
};

struct DataSet {
  std::vector<std::string> inputs;  ///< names of the input columns
  Eigen::MatrixXd rows;             ///< rows x (inputs + 1), the output last
  Eigen::MatrixXd is_test;          ///< rows x splits

  Eigen::Index splits() const { return is_test.cols(); }
  Trial trial(Eigen::Index split) const;
};

/// Names of the data sets in a folder, in alphabetical order.
std::vector<std::string> data_set_names(const std::string& folder);

/// Throws llmt::Csv's error if a file is missing or not numeric, and std::invalid_argument if the two files differ in
/// their number of rows.
DataSet read_data_set(const std::string& folder, const std::string& name);

}  // namespace bench
