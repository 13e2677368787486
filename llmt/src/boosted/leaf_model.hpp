/// \file
/// The local linear model of a leaf, estimated around that of the leaf's path.
#pragma once

#include <array>
#include <cmath>
#include <limits>

#include "boosted/split_gain.hpp"
#include "llmt/boosted_model.hpp"

namespace llmt {

using Slopes = std::array<double, most_boosted_slopes>;

/// Over the rows of a leaf, e the residual of its path's model and z its regressors.
struct RegressorSums {
  double n = 0.0;                                        ///< of weights w
  double s = 0.0;                                        ///< of w e
  double low = std::numeric_limits<double>::infinity();  ///< of the outputs of rows that are mostly in the leaf
  double high = -std::numeric_limits<double>::infinity();
  Slopes z = {};                                    ///< of w z
  Slopes ze = {};                                   ///< of w z e
  std::array<Slopes, most_boosted_slopes> zz = {};  ///< of w z z', the lower triangle
};

/// A model with its first slopes, and the range that its values are held to.
struct LeafModel {
  double constant = 0.0;
  double low = 0.0;
  double high = 0.0;
  Slopes slopes = {};
};

/// beta += (Z'Z + ridge I)^-1 Z'e about the path's model, all centred in the leaf; the constant is shrunk by its ridge.
/// The range is that of the rows' outputs and a tenth more on either side. The rows' weights must not all be 0.
void add_estimate(LeafModel& model, int slopes, const RegressorSums& sums, const Ridges& ridges);

/// What stands in for a missing value, to three digits behind the point: all of its digits would make a model file a
/// third longer and say nothing of a value that is not there.
inline double rounded_stand_in(double value) { return std::round(1000.0 * value) / 1000.0 + 0.0; }

/// What the rows on one side of a split ask for: a constant and, with has_slope, a slope in the split's feature.
struct SideModel {
  double constant = 0.0;
  double slope = 0.0;
};
SideModel side_model(const SideSums& side, bool has_slope, const Ridges& ridges);

}  // namespace llmt
