/// \file
/// The rows of a block, and the sample that is taken of them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <tuple>
#include <vector>

#include "base/sum_over.hpp"
#include "llmt/distributed.hpp"

namespace llmt::distributed {

/// The rows of one block.
struct Block {
  const Rows& rows;
  RowSpan span;
  Eigen::Index number;  // of the block in the table

  double at(Eigen::Index row, Eigen::Index column) const {
    if (column < rows.inputs.cols()) return rows.inputs(row, column);
    return column == rows.inputs.cols() ? rows.output(row) : rows.weights(row);
  }

  double weight(Eigen::Index row) const { return rows.weights.size() == 0 ? 1.0 : rows.weights(row); }
};

/// The rows with the smallest hashes of their block and place in it: a sample that is the same however sums are merged.
struct Sample {
  Eigen::Index most = 0;              ///< rows that are kept: Options::sample_rows
  std::vector<std::uint64_t> hashes;  ///< ascending
  std::vector<double> values;         ///< one row after the other: inputs, output, weight if there is one

  Sample& operator+=(const Sample& other);
  static auto fields(auto& self) { return std::tie(self.most, self.hashes, self.values); }
};

}  // namespace llmt::distributed
