/// \file
/// A model from the trees of a stream.
#pragma once

#include <vector>

#include "data/dataset.hpp"
#include "llmt/model.hpp"
#include "stream/tree.hpp"

namespace llmt {

/// What is known of a column of the stream.
struct ColumnRange {
  double low = 0.0;
  double high = 0.0;
  double mean = 0.0;
};

/// The tree as it stands, crisp, in the units of inputs and output. Splits in the order of what they gain.
Partition crisp_partition(const StreamTree& tree, const std::vector<ColumnRange>& columns, int output);

/// What predicts the rows `held_out` best, among the prefixes of the crisp tree and blends of it that are corrected on
/// the rows `others`. Too few rows: the tree as it is. Also sets the range that predictions are held to.
Partition choose(const TrainingRows& others, const TrainingRows& held_out, Partition crisp, ValidityChoice validity);

}  // namespace llmt
