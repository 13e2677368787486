/// \file
/// Columns of a table as the learner takes them: numbers, missing values, words as categories.
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

#include "llmt/csv.hpp"
#include "llmt/model.hpp"

namespace llmt::apps {

/// Which column of a table is what.
struct ColumnRoles {
  std::vector<std::string> inputs;
  std::vector<std::string> categorical;  ///< inputs that are categories although they are written as numbers
  std::vector<std::string> targets;
  std::string weight;  ///< empty: none
};

/// Whether a text is valid UTF-8. Names of columns and categories have to be: model files hold them.
bool is_utf8(std::string_view text);

/// Inputs to learn from.
struct InputColumns {
  Eigen::MatrixXd values;                        ///< rows x columns; NaN: missing; categories as positions in `levels`
  std::vector<std::vector<std::string>> levels;  ///< per column: sorted names; empty for numbers
  std::vector<int> categorical;                  ///< columns with levels
};

struct LearningColumns {
  InputColumns inputs;
  Eigen::MatrixXd targets;
  Eigen::VectorXd weights;  ///< empty if there is no such column
};

/// Reads the columns. An input is categorical if it is listed as such, or if none of its cells is a number. A cell that
/// is needed as a number and is none, a word among numbers, is an error, `path:line: column "c": ...`; for an input it
/// ends in `input_hint`. Throws std::runtime_error, also for a categorical column that is not among the inputs and for
/// a category that is not valid UTF-8.
LearningColumns read_learning_columns(const Csv& csv, const ColumnRoles& roles, const std::string& input_hint,
                                      int max_threads);

/// Inputs of a model.
struct ModelInputs {
  Eigen::MatrixXd values;    ///< as Model::predict() takes them
  Eigen::Index missing = 0;  ///< cells without a value
  Eigen::Index unknown = 0;  ///< cells with a category that training had not
};
ModelInputs read_inputs(const Csv& csv, const Model& model, int max_threads);

}  // namespace llmt::apps
