/// \file
/// The features of all rows, cut into bins once for a whole sum of trees.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "llmt/boosted_model.hpp"

namespace llmt {

/// Bins of present values; a code beyond them is a missing value.
inline constexpr int most_bins = 255;
inline constexpr std::uint8_t missing_code = 255;

/// A feature in all rows. Bin b holds edges[b - 1] < z <= edges[b].
struct BinnedFeature {
  BoostedFeature feature;
  std::vector<double> edges;        ///< ascending, one fewer than bins
  std::vector<double> centres;      ///< mean of the values in each bin
  std::vector<std::uint8_t> codes;  ///< bin of each row
  std::vector<float> values;        ///< z of each row, 0 where it is missing
  bool has_missing = false;
  double low = 0.0;  ///< smallest value
  double high = 0.0;

  int bins() const { return static_cast<int>(centres.size()); }
};

/// Cuts values into at most most_bins bins of about equal weight. An edge lies halfway between two neighbouring
/// values. NaN: missing.
BinnedFeature bin_feature(BoostedFeature feature, const Eigen::VectorXd& values, const Eigen::VectorXd& weights);

/// The rows of a fit.
struct BinnedRows {
  std::vector<BinnedFeature> features;
  Eigen::VectorXd weights;
  bool equal_weights = true;  ///< all 1
};

}  // namespace llmt
