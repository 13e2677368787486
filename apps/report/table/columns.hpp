/// \file
/// Columns of a table as the learner takes them: numbers, missing values, words as categories.
#pragma once

#include <Eigen/Core>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "llmt/boosted_model.hpp"
#include "llmt/csv.hpp"
#include "llmt/model.hpp"

namespace llmt::report {

/// Which column of a table is what.
struct ColumnRoles {
  std::vector<std::string> inputs;
  std::vector<std::string> categorical;  ///< inputs that are categories although they are written as numbers
  std::vector<std::string> targets;
  std::string weight;  ///< empty: none
};

/// The caller's words for what can be done about an input that cannot be read.
struct ColumnAdvice {
  std::string leave_out;      ///< ends the error: " (--ignore COLUMN leaves a column out)", or nothing
  std::string as_categories;  ///< stands before the column's name: "--categorical"
};

/// Cells of a column of words that say that there is no value, with one and the same text.
struct MarkedCells {
  int column = 0;
  std::string text;  ///< NA and the like
  Eigen::Index count = 0;
};

/// A column of words with more than most_categories different ones, and the first row that has one too many.
struct ManyWords {
  int column = 0;
  Eigen::Index row = 0;
};

/// Inputs to learn from.
struct InputColumns {
  Eigen::MatrixXd values;                        ///< rows x columns; NaN: missing; categories as positions in `levels`
  std::vector<std::vector<std::string>> levels;  ///< per column: sorted names; empty for numbers
  std::vector<int> categorical;                  ///< columns with levels
  std::vector<MarkedCells> marked = {};          ///< of columns of words that nobody called categories
  bool has_other_marks = false;                  ///< whether cells of other columns say so too
  std::vector<ManyWords> beyond_limit = {};      ///< nobody can learn from these columns
};

struct LearningColumns {
  InputColumns inputs;
  Eigen::MatrixXd targets;
  Eigen::VectorXd weights;  ///< empty if there is no such column
};

/// Throws std::runtime_error `path:line: column "c": ...` for the first value, in file order, whose magnitude is above
/// that of its column in `most`; NaN passes.
void refuse_large(const Csv& csv, std::span<const std::string> columns, const Eigen::MatrixXd& values,
                  std::span<const double> most);

/// The largest magnitude of a column over one table or several pieces, and where it stands.
struct LargestMagnitude {
  double value = 0.0;
  Eigen::Index line = 0;

  void add(const Csv& csv, const Eigen::Ref<const Eigen::VectorXd>& column);
  /// Throws std::runtime_error `file:line: column "c": ...` if it is so small, and not 0, that squares vanish.
  void refuse_small(const std::string& file, const std::string& column) const;
};

/// As refuse_large() for the first weight below 0.
void refuse_negative_weight(const Csv& csv, const std::string& column, const Eigen::VectorXd& weights);

/// Reads the columns. An input is categorical if it is listed as such, or if none of its cells is a number, with a
/// decimal comma either. In a column that is listed every text is a word, NA and the like too, and only an empty cell
/// is missing.
///
/// Throws std::runtime_error `path:line: column "c": ...` for a cell that is needed as a number and is none, and for
/// what the learner cannot take: numbers above `largest_input` (targets and weights: largest_magnitude), columns too
/// small to be squared, negative weights, weights that are all 0. Throws std::runtime_error
/// `path: column "c": ...` for a categorical column that is not among the inputs, and for a target or weight of words.
LearningColumns read_learning_columns(const Csv& csv, const ColumnRoles& roles, const ColumnAdvice& advice,
                                      double largest_input, int max_threads);

/// Words of a category that training had not, and in how many rows each stands.
using UnknownWords = std::map<std::string, Eigen::Index, std::less<>>;

/// Inputs of a model. A column of the table that is not there is missing in every row if the model does not use it, and
/// an error otherwise.
struct ModelInputs {
  Eigen::MatrixXd values;                        ///< as Model::predict() takes them
  Eigen::Index missing = 0;                      ///< cells without a value
  Eigen::Index unknown = 0;                      ///< cells with a category that training had not
  Eigen::Index unseen_codes = 0;                 ///< cells with a number that is none of InputColumn::codes
  std::vector<UnknownWords> unknown_words = {};  ///< one an input of the model; empty for numbers and codes
};
ModelInputs read_inputs(const Csv& csv, const Model& model, int max_threads);
ModelInputs read_inputs(const Csv& csv, const BoostedModel& model, int max_threads);

}  // namespace llmt::report
