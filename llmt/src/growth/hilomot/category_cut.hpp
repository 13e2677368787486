/// \file
/// Dividing rows by the levels of a categorical input, for two local models.
#pragma once

#include <limits>
#include <vector>

#include "growth/hilomot/oblique_split.hpp"

namespace llmt {

struct LevelCut {
  double loss = std::numeric_limits<double>::infinity();  ///< see share_loss(); infinite: there is no admissible cut
  std::vector<int> side;                                  ///< of every level: -1 left, 1 right, 0 does not occur
  double left_share = 0.0;                                ///< of rows without a level
  Eigen::VectorXd share;                                  ///< of the left child in the rows
  int evaluations = 0;
};

/// The best division of the levels into two sets. The levels that occur are put in order by the mean, over their rows,
/// of the residual times a regressor, which separates levels whose slopes differ. The three orders in which the levels
/// differ most are tried. Rows without a level (NaN among `values`) belong to both sides. `count`: levels of the input.
LevelCut best_level_cut(const GateProblem& problem, const Eigen::VectorXd& values, int count);

}  // namespace llmt
