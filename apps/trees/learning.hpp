/// \file
/// What `llmt fit` and `llmt compare` both ask: the table, its columns, growth and folds.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "llmt/fit.hpp"
#include "llmt/outliers.hpp"
#include "report/table/columns.hpp"

namespace llmt::apps {

struct LearningArguments {
  std::string data;
  std::vector<std::string> targets;
  std::vector<std::string> inputs;
  std::vector<std::string> ignored;
  std::vector<std::string> categorical;
  std::vector<std::string> split_inputs;
  std::vector<std::string> regression_inputs;
  std::vector<std::string> monotone;  ///< a leading minus: falling
  std::vector<std::string> slope_signs;
  std::string weight;
  bool contiguous = false;
  bool may_have_codes = true;  ///< see TrainingData
  DecimalMark mark = DecimalMark::point;
  bool thousands = false;
  FitOptions options;
};

void add_learning_options(CLI::App& command, LearningArguments& arguments);

/// Throws std::invalid_argument that lists the columns of the table if no target is named, and as read_table().
void require_target(const LearningArguments& arguments);

/// The columns to learn from: those asked for, or all but the targets, the weight and what is ignored. Throws as
/// read_learning_table().
std::vector<std::string> choose_inputs(const Csv& csv, const LearningArguments& arguments);

/// The same for a table of which only the columns and the name are known.
std::vector<std::string> choose_inputs(const std::vector<std::string>& columns, const std::string& name,
                                       const LearningArguments& arguments);

/// What --monotone and --slope-sign ask for, one entry an input; none if they ask for nothing. `levels`: of the inputs,
/// none for numbers.
std::vector<Trend> trends_of(const LearningArguments& arguments, const std::vector<std::string>& inputs,
                             const std::vector<std::vector<std::string>>& levels);

/// The table as the learner takes it, and the options with its columns filled in.
struct LearningTable {
  std::shared_ptr<const TrainingData> data;
  FitOptions options;
  std::vector<Eigen::Index> lines;  ///< of the rows, in the file
};

/// The dominant rows (outliers.hpp) of a target among those of positive weight; `weights`: empty: all 1.
DominantRows dominant_rows_of_target(const Eigen::Ref<const Eigen::VectorXd>& target, const Eigen::VectorXd& weights);

/// Throws std::runtime_error and std::invalid_argument that name file, line, column or option.
LearningTable read_learning_table(const LearningArguments& arguments);

}  // namespace llmt::apps
