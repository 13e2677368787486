/// \file
/// The tree of a stream as a partition of a model.
#pragma once

#include <vector>

#include "llmt/model.hpp"
#include "stream/node.hpp"
#include "stream/setting.hpp"

namespace llmt {

/// The tree below a node as a crisp partition, in the units of inputs and output. Splits are in the order of what they
/// gained. `columns`: of the inputs.
Partition crisp_partition(const StreamSetting& setting, const StreamNode& root, const std::vector<ColumnRange>& columns,
                          int output);

}  // namespace llmt
