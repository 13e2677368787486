/// \file
/// Few rows that carry most of the held-out squared error: likely wrong targets.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/fit.hpp"

namespace llmt::report {

/// Rows of one output that no model predicts.
struct GrossErrors {
  std::vector<Eigen::Index> rows = {};  ///< the largest error first
  double share = 0.0;                   ///< of the held-out squared error that they carry
  Eigen::Index held_out = 0;            ///< the number of held-out rows
};

/// At most one held-out row in a hundred (or one row) that carry more than half of the held-out squared error of the
/// output; else empty. Such a row has a value for every input. Its held-out error is more than 15 deviations
/// (RobustScale) of all errors and 8 deviations of those in its leaf, and the model that has seen the row is off by a
/// fifth of it at least: errors of honest rows with heavy tails, and beside jumps, are not like that. `result` is of
/// these data and has the intervals' models; without them it is empty.
GrossErrors gross_errors(const TrainingData& data, const FitResult& result, Eigen::Index output, int max_threads);

}  // namespace llmt::report
