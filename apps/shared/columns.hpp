/// \file
/// Columns of a table as the learner takes them: numbers, missing values, words as categories.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "llmt/csv.hpp"
#include "llmt/model.hpp"

namespace llmt::apps {

/// Inputs to learn from.
struct InputColumns {
  Eigen::MatrixXd values;                        ///< rows x columns; NaN: missing; categories as positions in `levels`
  std::vector<std::vector<std::string>> levels;  ///< per column: sorted names; empty for numbers
  std::vector<int> categorical;                  ///< columns with levels
};

/// Reads the named columns. One is categorical if it is listed in `categorical`, or if none of its cells is a number. A
/// word among numbers is an error, `path:line: column "c": ...`. Throws std::runtime_error, also for a categorical
/// column that is not among `columns`.
InputColumns read_inputs(const Csv& csv, const std::vector<std::string>& columns,
                         const std::vector<std::string>& categorical);

/// Inputs of a model.
struct ModelInputs {
  Eigen::MatrixXd values;      ///< as Model::predict() takes them
  std::ptrdiff_t missing = 0;  ///< cells without a value
  std::ptrdiff_t unknown = 0;  ///< cells with a category that training had not
};
ModelInputs read_inputs(const Csv& csv, const Model& model);

}  // namespace llmt::apps
