/// \file
/// A log cut into stretches of equally spaced samples.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/discovery/log.hpp"

namespace llmt::discovery {

/// Throws LogError as signals() says of the log.
void check_log(const Log& log);

/// Rows of a stretch of the log, `first` to `last`.
struct Part {
  Eigen::Index first = 0;
  Eigen::Index last = 0;
};

struct Timing {
  double step = 0.0;        ///< mean of the steps near the median, in s
  std::vector<Part> parts;  ///< in the order of the log
};

/// Throws LogError for times that do not increase within a run, runs that are there twice, and steps that differ too
/// much.
Timing timing_of(const Log& log);

/// Equally spaced samples of a part, positions before torques.
struct SampledStretch {
  double start = 0.0;  ///< in s
  double step = 0.0;   ///< in s
  Eigen::MatrixXd values;
  std::vector<Eigen::Index> rows;  ///< of the log, nearest in time
  bool interpolated = false;
};

SampledStretch samples_of(const Log& log, const Part& part, double step);

}  // namespace llmt::discovery
