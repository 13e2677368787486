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
#include "trees/fit_options.hpp"

namespace llmt::apps {

struct LearningArguments {
  std::string data;
  std::vector<std::string> targets;
  std::vector<std::string> inputs;
  std::vector<std::string> ignored;
  std::vector<std::string> categorical;
  std::string weight;
  std::string groups;
  bool may_have_codes = true;  ///< see TrainingData
  DecimalMark mark = DecimalMark::point;
  bool thousands = false;
  FitOptions options;    ///< those that are columns are filled in when the table is read
  NamedColumns columns;  ///< of these options
};

/// Adds what says which table and columns are learned from.
void add_learning_options(CLI::App& command, LearningArguments& arguments);

/// Throws std::invalid_argument that lists the columns of the table if no target is named, and as read_table().
void require_target(const LearningArguments& arguments);

/// The columns to learn from: those asked for, or all but the targets, the weight, the groups and what is
/// ignored. Throws as
/// read_learning_table().
std::vector<std::string> choose_inputs(const Csv& csv, const LearningArguments& arguments);

/// The same for a table of which only the columns and the name are known.
std::vector<std::string> choose_inputs(const std::vector<std::string>& columns, const std::string& name,
                                       const LearningArguments& arguments);

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
