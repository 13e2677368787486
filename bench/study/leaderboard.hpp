/// \file
/// Several methods on several tables, ranked as SRBench ranks them.
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

namespace bench {

/// One method on one table: medians over its trials.
struct Score {
  double r2 = 0.0;    ///< 1 - mean square of the test errors / variance of the test outputs
  double size = 0.0;  ///< operators, constants and variables, see llmt::expression_size
};

/// The scores by the names of the methods.
using Scores = std::map<std::string, Score>;

struct ScoredTable {
  std::string name;
  Eigen::Index rows = 0;
  Eigen::Index inputs = 0;
  Scores ours;
  Scores published;
};

/// A table of Friedman's function of five inputs: NUMBER_fri_cK_ROWS_INPUTS.
bool is_friedman(const std::string& table);

/// The columns dataset, method, median_r2 and median_model_size of a file: scores by table. Results that are missing
/// are left out. Throws llmt::Csv's errors.
std::map<std::string, Scores> read_published(const std::string& file);

/// Rank of a method on a table by R2, 1 for the largest: among the published methods that have a result, and one of
/// ours, either the method itself or `ours`. Equal ones share the mean of their ranks.
double rank_by_r2(const ScoredTable& table, const std::string& method, const std::string& ours);

/// The same by size, 1 for the smallest.
double rank_by_size(const ScoredTable& table, const std::string& method, const std::string& ours);

/// Mean of the values; NaN if there is none.
double mean(const std::vector<double>& values);

/// Median, of an even number of values the mean of the middle two; NaN if there is none.
double median(std::vector<double> values);

/// Prints the mean R2 of our methods and of three published ones: on all tables, on those that are not Friedman's, and
/// on Friedman's by inputs and rows.
void print_means(const std::vector<ScoredTable>& tables);

/// Prints for every method the mean rank by R2 on all tables, on Friedman's and on the others, and the median ranks by
/// R2 and by size, with a mark at the methods that no other one beats in one of these without losing in the other.
/// Published methods are ranked beside `ours`.
void print_ranks(const std::vector<ScoredTable>& tables, const std::string& ours);

}  // namespace bench
