/// \file
/// HILOMOT, the hierarchical local model tree of Nelles (2006): oblique splits with logistic gates
/// (docs/algorithms/hilomot.md).
#pragma once

#include "growth/hilomot/oblique_split.hpp"
#include "growth/problem.hpp"

namespace llmt {

/// Options of HILOMOT besides the growth options, of which it uses max_leaves, the inputs and min_leaf_samples.
struct HilomotOptions {
  /// How the local models are fitted while the plane is sought. They should be fitted as the leaves will be.
  GateModels models = GateModels::local;
  bool stop_by_aicc = false;  ///< keep the number of leaves with the smallest corrected Akaike criterion
};

/// Grows by splitting the worst local model, the one with the largest sum of validity times squared error of the whole
/// model, by the plane and gate that leave the smallest error in its rows (H.3). Only the two new models are estimated,
/// by weighted least squares. All other validities stay, because the two shares of a split sum to 1. The caller
/// multiplies the half widths of growth by Validity::width.
///
/// A categorical input is split into sets of levels, without a transition, where that leaves a smaller error than any
/// plane. If the worst model cannot be split, the next one is.
GrownPartition grow_hilomot(const GrowthProblem& problem, const HilomotOptions& hilomot);

}  // namespace llmt
