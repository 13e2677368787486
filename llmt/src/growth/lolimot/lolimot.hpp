/// \file
/// LOLIMOT, the local linear model tree of Nelles (2001, chapter 13).
#pragma once

#include "growth/problem.hpp"

namespace llmt {

/// What LOLIMOT is told besides the growth options, of which it uses max_leaves, the inputs and min_leaf_samples.
struct LolimotOptions {
  double width = 1.0 / 3.0;  ///< k_sigma: standard deviations of the validity functions by the sides of their boxes
  Eigen::VectorXd low;       ///< of the split inputs over the training rows: closes the boxes
  Eigen::VectorXd high;
  bool data_driven = false;   ///< thresholds where two crisp models of the box's rows leave least, not in its middle
  bool stop_by_aicc = false;  ///< keep the number of leaves with the smallest corrected Akaike criterion
};

/// Grows by splitting the worst local model, the one with the largest sum of validity times squared error, along the
/// input that leaves the smallest error of the whole model. After a split all validities change by normalisation, but
/// only the two new models are estimated, by weighted least squares.
///
/// Departures from the source: rows without a value count as being in the middle of every box in that direction; a
/// split is skipped if a side has less validity than a local model has coefficients, and a worst model that cannot be
/// split gives way to the next.
GrownPartition grow_lolimot(const GrowthProblem& problem, const LolimotOptions& lolimot);

}  // namespace llmt
