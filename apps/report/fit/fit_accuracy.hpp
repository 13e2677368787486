/// \file
/// Charts of a fit that say how far to trust it.
#pragma once

#include <optional>

#include "report/fit/of_fit.hpp"

namespace llmt::report {

/// Predictions of one output on the rows that were held out, by the models that had not seen them.
struct HeldOutRows {
  bool held_out = true;  ///< else there were no folds, and these are the rows that were fitted
  Numbers observed;
  Numbers predicted;
  Numbers errors;  ///< predicted - observed
  double rmse = 0.0;
  double r2 = 0.0;
  Eigen::Index left_out = 0;  ///< rows that the loss left out, which are not here
  double p90 = 0.0;           ///< nine of ten errors are at most this large
};

HeldOutRows held_out(const Fitted& fitted, Eigen::Index output);

Chart predicted_against_observed(const HeldOutRows& rows, const std::string& name);
Chart residuals(const HeldOutRows& rows, const std::string& name);
Chart error_histogram(const HeldOutRows& rows);

/// The held-out error over the number of leaves, and the best of each kind with the spread of its folds.
Chart error_over_leaves(const PartitionSummary& partition);

}  // namespace llmt::report
