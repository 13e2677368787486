/// \file
/// The features of all rows, cut into bins once for a whole sum of trees.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "llmt/boosted_model.hpp"

namespace llmt {

/// A split lies between two cells. It is found between two bins, which are neighbouring cells put together, and then
/// refined. A number beyond the cells or bins is that of a missing value.
inline constexpr int most_cells = 65535;
inline constexpr int most_bins = 128;
inline constexpr std::uint16_t missing_cell = most_cells;
inline constexpr std::uint8_t missing_bin = most_bins;

/// A feature in all rows. Cell c holds edges[c - 1] < z <= edges[c].
struct BinnedFeature {
  BoostedFeature feature;
  std::vector<double> edges;         ///< ascending, one fewer than cells
  std::vector<int> last_cells;       ///< of each bin
  std::vector<double> centres;       ///< mean of the values in each bin
  std::vector<std::uint16_t> cells;  ///< of each row
  std::vector<std::uint8_t> bins;    ///< of each row
  std::vector<float> values;         ///< z of each row, 0 where it is missing
  bool has_missing = false;
  double low = 0.0;  ///< smallest value
  double high = 0.0;

  /// Of a row; NaN: missing.
  double value(Eigen::Index row) const {
    return cells[row] == missing_cell ? std::numeric_limits<double>::quiet_NaN() : values[row];
  }
  int num_bins() const { return static_cast<int>(centres.size()); }
};

/// Cuts values into cells, one for each value if there are at most most_cells, and these into at most most_bins bins;
/// else cells or bins have about equal weight. An edge lies halfway between two neighbouring values. NaN: missing.
BinnedFeature bin_feature(BoostedFeature feature, const Eigen::VectorXd& values, const Eigen::VectorXd& weights);

/// A list whose copies share the features, so that copies with further ones take no memory for those that are there.
class BinnedFeatures {
 public:
  void push_back(BinnedFeature feature) {
    features_.push_back(std::make_shared<const BinnedFeature>(std::move(feature)));
  }
  std::size_t size() const { return features_.size(); }
  const BinnedFeature& operator[](std::size_t k) const { return *features_[k]; }

 private:
  std::vector<std::shared_ptr<const BinnedFeature>> features_;
};

/// The rows of a fit.
struct BinnedRows {
  BinnedFeatures features = {};
  Eigen::VectorXd weights;
  bool equal_weights = true;  ///< all 1
};

/// The rows 0 ... count - 1.
std::vector<int> all_rows(Eigen::Index count);

}  // namespace llmt
