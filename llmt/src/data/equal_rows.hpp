/// \file
/// Rows that repeat other rows.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace llmt {

/// Numbers the different rows of some columns of a table, in order of first appearance. `rows`: those of the table that
/// count. Missing values equal each other.
std::vector<int> number_different_rows(const Eigen::Ref<const Eigen::MatrixXd>& table,
                                       const std::vector<Eigen::Index>& rows, const std::vector<int>& columns,
                                       int max_threads = 1);

/// Which rows of a table are equal: rows with equal numbers have equal inputs, or equal inputs and outputs.
struct RowNumbers {
  std::vector<int> by_inputs = {};  ///< empty: no two rows have equal inputs
  std::vector<int> by_all = {};
  /// By the inputs that do not run, as a time stamp or a counter does, which grows from each row to the next or falls.
  /// Empty: no input runs, or all do, or no two rows are equal in the others.
  std::vector<int> by_setting = {};
  std::vector<int> setting_columns = {};  ///< the inputs that do not run
};

/// The numbers of the given rows. All rows are hashed and sorted, so a fit asks once (times_rows_were_numbered()).
RowNumbers number_rows(const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                       const Eigen::Ref<const Eigen::MatrixXd>& outputs, const std::vector<Eigen::Index>& rows,
                       int max_threads = 1);

/// How often number_rows() was called in this process, for tests.
long times_rows_were_numbered();

/// The numbers at some positions, ascending. Of a position that is there more than once, all rows are equal.
RowNumbers at(const RowNumbers& numbers, const std::vector<Eigen::Index>& positions);

/// Rows that are no measurements of their own, see "Rows with equal inputs" (C.2) in docs/algorithms/selection.md.
struct EqualRows {
  bool are_repeats = false;  ///< rows with equal inputs are repeats of one measurement
  /// A number for each row; rows with the same number must share a fold. Empty: every row stands alone.
  std::vector<int> group = {};
  /// For each row the position among `rows` of the row that it copies, or its own. Empty: there are no copies.
  std::vector<int> copy_of = {};
};

/// `numbers`: of `rows`, which are rows of `inputs`.
EqualRows find_equal_rows(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const std::vector<Eigen::Index>& rows,
                          const RowNumbers& numbers);

}  // namespace llmt
