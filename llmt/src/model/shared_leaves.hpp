/// \file
/// Model files of earlier versions, in which several leaves may share one local model.
#pragma once

#include <optional>
#include <vector>

#include "llmt/model.hpp"

namespace llmt {

/// Sets Node::guard_parent of leaves that share a local model in a file: the root of the smallest subtree that holds
/// them all, as the version that wrote the file evaluated them. `shared_with`: one per node, the first leaf with the
/// same local model, or none. The coefficients need no copying, because the file repeats them in each leaf.
/// Throws std::invalid_argument if an entry is not the position of an earlier leaf with a local model of its own.
void set_guard_parents(Partition& partition, const std::vector<std::optional<int>>& shared_with);

}  // namespace llmt
