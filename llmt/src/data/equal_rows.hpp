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

/// Rows that are no measurements of their own, see "Rows with equal inputs" (C.2) in docs/algorithms/selection.md.
struct EqualRows {
  bool are_repeats = false;  ///< rows with equal inputs are repeats of one measurement
  /// Of each row, what it must share a fold with. Empty: every row stands alone.
  std::vector<int> group;
  /// Of each row, the position among `rows` of the row that it copies, itself if none. Empty: there are no copies.
  std::vector<int> copy_of;
};
EqualRows find_equal_rows(const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                          const Eigen::Ref<const Eigen::MatrixXd>& outputs, const std::vector<Eigen::Index>& rows,
                          int max_threads = 1);

}  // namespace llmt
