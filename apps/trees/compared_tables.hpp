// The tables of `llmt discover`: what a simulation says and what was measured, row by row.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "llmt/csv.hpp"
#include "llmt/discovery/missing.hpp"
#include "llmt/discovery/model_term.hpp"

namespace llmt::apps {

/// Files and the names of their columns.
struct ComparedTables {
  std::string simulated;
  std::string measured;
  std::vector<std::string> inputs;
  std::vector<std::string> outputs;
  std::string order;
  std::string time;
  std::string group;
  DecimalMark mark = DecimalMark::point;
};

/// A column that says of each row when it was taken, or of which run it is, as its cells stand in the file.
struct LabelColumn {
  std::string name;
  std::vector<std::string> cells;
};

/// Both tables, row by row.
struct Comparison {
  discovery::Inputs inputs;  ///< with the order, if that is a column of its own
  Eigen::MatrixXd simulated;
  discovery::MeasuredOutputs measured;
  std::vector<Eigen::Index> lines;  ///< of the rows, in the file measured
  std::vector<LabelColumn> labels;  ///< time and group, as far as they are given
};

/// Times of the rows. Throws std::runtime_error for a cell that is not a number.
Eigen::VectorXd instants_of(const Csv& csv, const std::string& column);

/// The inputs, which both files must have alike, n x names; `every_column`: they were not named. Throws
/// std::runtime_error naming file, line and column of a row that differs.
Eigen::MatrixXd read_same_inputs(const Csv& simulated, const Csv& measured, const std::vector<std::string>& names,
                                 bool every_column);

/// Throws std::runtime_error for a row whose time since the first differs in the two files by more than half a step.
/// `instants`: those of `measured`.
void refuse_other_times(const Csv& simulated, const Csv& measured, const std::string& column,
                        const Eigen::VectorXd& instants);

/// The run that each row is of, numbered as they first occur.
std::vector<Eigen::Index> runs_of(const Csv& csv, const std::string& column);

/// Throws std::invalid_argument for names that are given twice or contradict each other.
void check_names(const ComparedTables& tables);

/// Standard deviations that the columns "noise_" + name hold, as `llmt signals` writes them: the root of their mean
/// square; NaN where there is no such column, and empty if there is none at all. Throws std::runtime_error for one
/// below 0.
Eigen::VectorXd noise_of(const Csv& csv, const std::vector<std::string>& names);

/// Of the filter that `llmt signals` says the rows went through, in its column "cutoff_hz"; 0: there is none. Throws
/// std::runtime_error for values that are not above 0 or not the same.
double cutoff_of(const Csv& csv);

/// `every_column`: the inputs were not named. Throws std::runtime_error naming file, line and column.
Comparison read_comparison(const ComparedTables& tables, bool every_column);

}  // namespace llmt::apps
