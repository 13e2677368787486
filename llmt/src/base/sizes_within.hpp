/// \file
/// The largest size for which a time is enough.
#pragma once

#include <Eigen/Core>
#include <functional>

#include "llmt/progress.hpp"

namespace llmt {

/// What sizes_within() goes through.
struct SizeRange {
  Eigen::Index least = 1;  ///< is done to its end, whatever the time
  Eigen::Index most = 1;
  double power = 1.0;  ///< the time of a task grows with this power of its size, or less
};

/// Seconds since some moment.
using Clock = std::function<double()>;

/// The clock of the machine that is never set back.
double steady_seconds();

/// Does `task` for sizes that grow as the time allows, and returns the largest that ended. `task`: called with a size
/// and what it is to report to; it keeps its result when it ends. The size that is under way when `seconds` from the
/// call are over is cancelled. Throws what `task` and `progress` throw.
Eigen::Index sizes_within(double seconds, const SizeRange& sizes,
                          const std::function<void(Eigen::Index size, const Progress& progress)>& task,
                          const Progress& progress, const Clock& clock = steady_seconds);

}  // namespace llmt
