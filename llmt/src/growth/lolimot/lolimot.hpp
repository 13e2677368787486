/// \file
/// LOLIMOT, the local linear model tree of Nelles (2001, chapter 13): docs/algorithms/lolimot.md.
#pragma once

#include "growth/problem.hpp"

namespace llmt {

/// Options of LOLIMOT besides the growth options, of which it uses max_leaves, the inputs and min_leaf_samples.
struct LolimotOptions {
  double width = 1.0 / 3.0;  ///< k_sigma: standard deviations of the validity functions by the sides of their boxes
  Eigen::VectorXd low;       ///< of the split inputs over the training rows: closes the boxes
  Eigen::VectorXd high;
  bool data_driven = false;   ///< threshold with the smallest RSS of two crisp models, not the middle of the box
  bool stop_by_aicc = false;  ///< keep the number of leaves with the smallest corrected Akaike criterion
};

/// Grows by splitting the worst local model, the one with the largest sum of validity times squared error, along the
/// input that leaves the smallest error of the whole model. After a split all validities change by normalisation, but
/// only the two new models are estimated, by weighted least squares.
///
/// Departures from the source: rows without a value count as being in the middle of every box in that direction; a
/// split is skipped if the validities of a side sum to less than the number of coefficients of a local model. If the
/// worst model cannot be split, the next one is.
GrownPartition grow_lolimot(const GrowthProblem& problem, const LolimotOptions& lolimot);

}  // namespace llmt
