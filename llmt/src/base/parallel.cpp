#include "base/parallel.hpp"

#if defined(__SANITIZE_THREAD__)
#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>
#else
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#endif

namespace llmt {

#if defined(__SANITIZE_THREAD__)

// ThreadSanitizer does not see into oneTBB, and takes what its threads hand over to each other for races. Threads of
// the standard library it sees. Nested calls run on one thread.
void parallel_for(Eigen::Index count, int max_threads, const std::function<void(Eigen::Index)>& body) {
  thread_local bool is_nested = false;
  constexpr Eigen::Index usual_threads = 4;
  const Eigen::Index threads = std::min(count, is_nested ? 1 : max_threads > 0 ? max_threads : usual_threads);
  std::atomic<Eigen::Index> next = 0;
  std::exception_ptr thrown;
  std::mutex mutex;
  const auto work = [&] {
    const bool was_nested = std::exchange(is_nested, true);
    try {
      for (Eigen::Index i = next++; i < count; i = next++) body(i);
    } catch (...) {
      const std::lock_guard lock(mutex);
      thrown = std::current_exception();
    }
    is_nested = was_nested;
  };
  std::vector<std::thread> others;
  for (Eigen::Index i = 1; i < threads; ++i) others.emplace_back(work);
  work();
  for (std::thread& other : others) other.join();
  if (thrown) std::rethrow_exception(thrown);
}

#else

void parallel_for(Eigen::Index count, int max_threads, const std::function<void(Eigen::Index)>& body) {
  if (max_threads == 1 || count <= 1) {
    for (Eigen::Index i = 0; i < count; ++i) {
      body(i);
    }
    return;
  }
  const auto run = [&] {
    // Where a body of an outer loop throws, oneTBB would end the loops inside its other bodies early and in silence,
    // and these bodies would go on with empty slots.
    tbb::task_group_context own(tbb::task_group_context::isolated);
    const auto bodies = [&](const auto& range) {
      for (Eigen::Index i = range.begin(); i != range.end(); ++i) {
        body(i);
      }
    };
    tbb::parallel_for(tbb::blocked_range<Eigen::Index>(0, count, 1), bodies, own);
  };
  // A nested call already runs inside an arena that is small enough.
  if (max_threads <= 0 || tbb::this_task_arena::max_concurrency() <= max_threads) {
    run();
  } else {
    // An arena of its own, not a process-wide limit: two callers with different limits do not disturb each other.
    tbb::task_arena(max_threads).execute(run);
  }
}

#endif

}  // namespace llmt
