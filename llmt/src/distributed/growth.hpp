/// \file
/// From the sums of a pass to the next state.
#pragma once

#include "distributed/block_sums.hpp"
#include "distributed/state.hpp"
#include "llmt/progress.hpp"

namespace llmt::distributed {

/// Means, scales and bins of the columns, and the root. Throws std::runtime_error if there are no rows, or if they are
/// too many for one memory and some input has missing values.
void take_description(StateData& data, Description description);

/// The split of every node that was asked for. Its sums are the entries of `sums`.
void take_nodes(StateData& data, std::map<Eigen::Index, NodeSums> sums);

/// What the next pass asks for: nodes to split first, then branches, as many as memory allows.
void ask(StateData& data);

/// Finishes the branches that were asked for by fit().
void take_branches(StateData& data, std::map<Eigen::Index, BranchRows> rows, const Progress& progress, int max_threads);

/// Takes the splits back that do not lower the held-out error, and makes one model of top and branches.
void finish(StateData& data);

}  // namespace llmt::distributed
