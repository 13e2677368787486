/// \file
/// A model from the trees of a stream.
#pragma once

#include <vector>

#include "llmt/model.hpp"
#include "reservoir.hpp"
#include "stream_tree.hpp"

namespace llmt {

/// What is known of a column of the stream.
struct ColumnRange {
  double low = 0.0;
  double high = 0.0;
  double mean = 0.0;
};

/// The tree as it stands, crisp, in the units of inputs and output. Splits in the order of what they gain.
Partition crisp_partition(const StreamTree& tree, const std::vector<ColumnRange>& inputs, int output);

}  // namespace llmt
