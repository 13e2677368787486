#include "base/parallel.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace llmt {

void parallel_for(Eigen::Index count, int max_threads, const std::function<void(Eigen::Index)>& body) {
  if (max_threads == 1 || count <= 1) {
    for (Eigen::Index i = 0; i < count; ++i) {
      body(i);
    }
    return;
  }
  const auto run = [&] {
    tbb::parallel_for(tbb::blocked_range<Eigen::Index>(0, count, 1), [&](const auto& range) {
      for (Eigen::Index i = range.begin(); i != range.end(); ++i) {
        body(i);
      }
    });
  };
  // A nested call already runs inside an arena that is small enough.
  if (max_threads <= 0 || tbb::this_task_arena::max_concurrency() <= max_threads) {
    run();
  } else {
    // An arena of its own, not a process-wide limit: two callers with different limits do not disturb each other.
    tbb::task_arena(max_threads).execute(run);
  }
}

}  // namespace llmt
