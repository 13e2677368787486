/// \file
/// The choice of a snapshot of a stream.
#pragma once

#include "data/dataset.hpp"
#include "llmt/model.hpp"
#include "llmt/options.hpp"

namespace llmt {

/// Among the prefixes of the crisp tree and blends of it, the one that predicts the rows `held_out` best. Blends are
/// corrected on the rows `others`, see BlendCorrection. If there are too few rows, the tree as it is. Sets
/// Partition::residual_range as well.
Partition choose(const TrainingRows& others, const TrainingRows& held_out, Partition crisp, ValidityChoice validity);

}  // namespace llmt
