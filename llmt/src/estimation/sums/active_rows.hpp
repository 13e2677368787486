/// \file
/// Some rows with the leaves that reach them, laid out for sums over the rows of each leaf.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "data/dataset.hpp"
#include "partition/evaluator.hpp"

namespace llmt {

/// Rows and the leaves of a partition that reach them.
struct ActiveRows {
  /// Columns of zeros behind the validities.
  static constexpr Eigen::Index more_columns = 8;

  /// A leaf that reaches a row.
  struct Entry {
    int leaf;
    double validity;
  };
  /// A row that a leaf reaches.
  struct Use {
    Eigen::Index row;
    Eigen::Index before;  ///< position of the row's first entry
    Eigen::Index entry;   ///< position of the leaf's entry for this row
  };

  Chunk chunk;
  std::vector<Entry> entries;           ///< row after row; within a row by ascending leaf
  std::vector<Use> uses;                ///< leaf after leaf; within a leaf by ascending row
  std::vector<Eigen::Index> first_use;  ///< of every leaf; and the number of all uses
  std::vector<int> leaves;              ///< that some row reaches, ascending
  std::vector<Eigen::Index> column;     ///< of every leaf, its place among `leaves` or where it would stand
  RowMajor validities;                  ///< rows x leaves; 0: the leaf does not reach the row; then columns of zeros
  RowMajor regressors;                  ///< [1, x] in scaled columns; NaN: missing
  RowMajor residuals;                   ///< of the root's model
  /// Lower triangles of a a' row by row, in strips of `lanes` numbers padded with zeros: strip after strip, in a strip
  /// row after row. Empty if values are missing.
  std::vector<double> outer;
};

/// What the rows are described with.
struct PartitionContext {
  const TrainingRows& training;
  const Partition& partition;
  const Evaluator& evaluator;
  const std::vector<int>& leaf_of_node;  ///< -1: inner node
  const Eigen::MatrixXd& root;           ///< coefficients of the root's model, size x outputs
  bool leaves_out_ambiguous;             ///< see leaves_out_ambiguous()
};

/// The rows at `positions` among the training rows.
ActiveRows active_rows(const PartitionContext& by, const std::vector<int>& positions);

/// The regressors of a row as a node sees them, which replaces missing ones by its means.
Eigen::VectorXd regressors_at(const PartitionContext& by, const Chunk& chunk, Eigen::Index row, int node);

}  // namespace llmt
