/// \file
/// Rows to predict, laid out for evaluation.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "llmt/partition.hpp"

namespace llmt {

struct RowBlock {
  Eigen::Ref<const Eigen::MatrixXd> inputs;  ///< rows x inputs
  std::vector<bool> has_missing = {};        ///< one per input: whether some row lacks it
  bool has_infinite = false;                 ///< some value is infinite: not to be predicted
  Eigen::Index stride = 0;                   ///< from the deviations of a row to those of the next
  /// Deviations of the regressors from their centres, one row after the other, padded with zeros to whole quads; NaN if
  /// an input is missing or its level unknown.
  std::vector<double> deviations = {};

  Eigen::Index rows() const { return inputs.rows(); }
};

/// How many rows make a block: what it holds stays in a cache of the second level. `depth`: of the deepest tree; every
/// split above a leaf may hold a list of the block's rows that wait.
Eigen::Index rows_of_block(Eigen::Index inputs, Eigen::Index regressors, Eigen::Index depth);

/// Lays out rows of a model's inputs, which must outlive the block.
RowBlock make_row_block(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const std::vector<InputColumn>& columns,
                        const std::vector<Regressor>& regressors);

}  // namespace llmt
