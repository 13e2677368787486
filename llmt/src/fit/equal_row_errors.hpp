/// \file
/// What rows with equal inputs say of the held-out error: docs/algorithms/selection.md, "Rows with equal inputs".
#pragma once

#include <optional>
#include <vector>

#include "data/training.hpp"
#include "llmt/summary.hpp"

namespace llmt {

/// None if no two kept rows have equal inputs. `of_folds`: the partition that each fold predicts its held-out rows
/// with.
std::optional<EqualRowErrors> equal_row_errors(const Training& training, const std::vector<Partition>& of_folds);

}  // namespace llmt
