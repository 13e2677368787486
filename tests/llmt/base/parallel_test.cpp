// Loops over independent slots.
#include "base/parallel.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>

namespace {

TEST(Parallel, ALoopInsideAnotherOneRunsToItsEndThoughTheOuterOneFails) {
  constexpr Eigen::Index slots = 2000;
  for (int repeat = 0; repeat < 20; ++repeat) {
    std::atomic<bool> is_inside = false;
    std::atomic<Eigen::Index> ended = 0;  // slots, if the inner loop came back
    const auto fails_meanwhile = [&](Eigen::Index job) {
      if (job == 0) {
        for (int k = 0; k < 100000 && !is_inside; ++k) continue;  // for long enough, if there is another thread
        throw std::runtime_error("stop");
      }
      std::atomic<Eigen::Index> done = 0;
      llmt::parallel_for(slots, 2, [&](Eigen::Index) {
        is_inside = true;
        ++done;
      });
      ended = done.load();
    };
    EXPECT_THROW(llmt::parallel_for(2, 2, fails_meanwhile), std::runtime_error);
    EXPECT_TRUE(ended == 0 || ended == slots) << ended;
  }
}

}  // namespace
