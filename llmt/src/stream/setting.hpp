/// \file
/// What all parts of a stream's tree share: a row, and the setting.
#pragma once

#include <Eigen/Core>

#include "numerics/gram.hpp"

namespace llmt {

/// A local model is not made from fewer rows per coefficient than this.
inline constexpr Eigen::Index few_rows_per_coefficient = 2;

/// A row on its way down a tree.
struct StreamRow {
  const double* x;  ///< inputs; NaN: missing
  const double* z;  ///< the same in scaled units
  double y;
  double weight;
  /// Number of different rows divided by number of rows. Rows that come again are no new evidence, so all tests
  /// multiply the number of rows by this.
  double different;
};

/// The setting of a tree. The first six are those of StreamOptions, with the defaults filled in.
struct StreamSetting {
  double significance = 0.05;
  double min_variance_gain = 0.0;
  Eigen::Index min_leaf_samples = 0;
  Eigen::Index max_leaves = 0;
  int bins = 16;
  double shrinkage = 0.1;  ///< in rows
  Eigen::Index inputs;
  GramShape shape;
  double output_variance = 0.0;  ///< of the first rows
  double rounding = 0.0;         ///< residuals below this are rounding
  Eigen::VectorXd centre;        ///< of the inputs: z = (x - centre) / scale
  Eigen::VectorXd scale;
  bool detect_drift = true;  ///< false only in tests of what streams do without it

  Eigen::Index coefficients() const { return inputs + 1; }
  double scaled(Eigen::Index input, double x) const { return (x - centre(input)) / scale(input); }
  double unscaled(Eigen::Index input, double z) const { return centre(input) + scale(input) * z; }
};

/// Inputs in scaled units.
inline void set_scaled(const StreamSetting& setting, const double* x, Eigen::VectorXd& z) {
  for (Eigen::Index j = 0; j < setting.inputs; ++j) z(j) = setting.scaled(j, x[j]);
}

/// What is known of a column of the stream.
struct ColumnRange {
  double low = 0.0;
  double high = 0.0;
  double mean = 0.0;
};

}  // namespace llmt
