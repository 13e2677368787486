/// \file
/// A tree as its leaves will be estimated from: grown, put in the order of pruning, with signs and jumps.
#pragma once

#include "estimation/estimate.hpp"
#include "fit/plan/defaults.hpp"

namespace llmt {

struct FinalTree {
  GrownTree tree;
  StopReason stop = StopReason::leaf_samples;
  SearchSummary search;
};

/// Grows a tree for the outputs `served`. `keeps_all_leaves`: no held-out rows will choose how many leaves stay.
/// `work`: of this tree.
FinalTree grow_tree(const TrainingRows& rows, const std::vector<int>& served, const Plan& plan, bool keeps_all_leaves,
                    int max_threads, Work& work);

}  // namespace llmt
