/// \file
/// From a grown tree to the model of a candidate.
#pragma once

#include <Eigen/Core>

#include "data/dataset.hpp"
#include "llmt/progress.hpp"
#include "llmt/summary.hpp"

namespace llmt {

/// A grown tree, and how far the outputs jump at its splits.
struct GrownTree {
  Partition partition;
  Eigen::VectorXd jumps;  ///< of every node, see jump_sizes()
};

/// The tree with the half widths (V.3) of a validity. Splits with a jump of at least `jump` stay crisp.
Partition blended(const TrainingRows& training, const GrownTree& grown, const Validity& validity, double jump);

/// The partition with `candidate`'s leaves, validity and estimates. `work`: reports on the way, and may stop it.
Partition estimate(const TrainingRows& training, const GrownTree& grown, const Candidate& candidate, int max_threads,
                   Work& work);

}  // namespace llmt
