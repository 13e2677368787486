/// \file
/// Parallelism over independent slots: the only way this library runs on several threads.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>

namespace llmt {

/// Calls body(0) ... body(count - 1), each once, in any order and on up to `max_threads` threads (0: all that the
/// machine has).
///
/// Each call must write to its own slot only; sums over rows are formed by sum_over(). Results are then the same bytes
/// at every thread count. Calls may be nested. An exception that a body throws is passed on.
void parallel_for(Eigen::Index count, int max_threads, const std::function<void(Eigen::Index)>& body);

}  // namespace llmt
