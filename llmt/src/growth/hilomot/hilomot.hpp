/// \file
/// HILOMOT, the hierarchical local model tree of Nelles (2006): oblique splits with logistic gates.
#pragma once

#include "growth/hilomot/oblique_split.hpp"
#include "growth/problem.hpp"

namespace llmt {

/// What HILOMOT is told besides the growth options, of which it uses max_leaves, the inputs and min_leaf_samples.
struct HilomotOptions {
  /// How the local models are fitted while the plane is sought: as they will be in the end.
  GateModels models = GateModels::local;
  bool stop_by_aicc = false;  ///< keep the number of leaves with the smallest corrected Akaike criterion
};

/// Grows by splitting the worst local model, the one with the largest sum of validity times squared error of the whole
/// model, by the plane and gate that leave its rows the smallest error (oblique_split.hpp). Only the two new models are
/// estimated, by weighted least squares; all other validities stay, for the gates of a split sum to 1. Half widths are
/// those of growth; the caller multiplies them by Validity::width.
///
/// A categorical input is split into sets of levels, without a transition, where that leaves less than any plane. A
/// worst model that cannot be split gives way to the next.
GrownPartition grow_hilomot(const GrowthProblem& problem, const HilomotOptions& hilomot);

}  // namespace llmt
