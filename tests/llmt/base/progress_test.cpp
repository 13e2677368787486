#include "llmt/progress.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <vector>

#include "base/parallel.hpp"
#include "watched.hpp"

namespace {

using llmt::Progress;
using llmt::ProgressReport;
using llmt::Work;

std::vector<int> done_of(const std::function<void(const Progress&)>& call) {
  std::vector<int> done;
  call([&](const ProgressReport& report) {
    done.push_back(report.done);
    return true;
  });
  return done;
}

TEST(Work, PartsCountAsTheirShares) {
  const std::vector<int> done = done_of([](const Progress& progress) {
    Work work(progress);
    Work half(work, 0.5);
    Work half_of_it(half, 0.5);
    half_of_it.did(0.5);
    EXPECT_EQ(half.left(), 0.75);
    half_of_it.did(0.75);  // more than there is
    EXPECT_EQ(half.left(), 0.5);
    half.finish();
    work.did(0.25);
    work.check();
    work.finish();
  });
  EXPECT_EQ(done, (std::vector<int>{125, 250, 500, 750, 750, 999, 1000}));
}

TEST(Work, CallsWithProgressAreParts) {
  const auto tenths = [](const Progress& progress) {
    Work work(progress);
    for (int k = 0; k < 4; ++k) work.did(0.25);
    work.finish();
  };
  const std::vector<int> done = done_of([&](const Progress& progress) {
    Work work(progress);
    Work part(work, 0.4);
    tenths(part.progress());
    work.finish();
  });
  EXPECT_EQ(done, (std::vector<int>{100, 200, 300, 399, 399, 400, 999, 1000}));
}

TEST(Work, WithoutACallbackNothingIsCounted) {
  Work work;
  Work part(work, 0.5);
  part.finish();
  EXPECT_FALSE(part.progress());
  EXPECT_EQ(work.left(), 1.0);
}

TEST(Work, ReportsTheNameOfTheStep) {
  std::vector<std::string> steps;
  Work work([&](const ProgressReport& report) {
    steps.push_back(report.step);
    return true;
  });
  work.check();
  work.begin("first");
  work.did(0.5);
  EXPECT_EQ(steps, (std::vector<std::string>{"", "first", "first"}));
}

// One call at a time, and the same exception on all threads.
TEST(Work, StopsAllThreads) {
  std::atomic<int> inside = 0;
  int calls = 0;
  std::atomic<int> ended = 0;
  EXPECT_THROW(
      {
        Work work([&](const ProgressReport&) -> bool {
          EXPECT_EQ(++inside, 1);
          if (++calls == 50) throw watched::OwnError{7};
          --inside;
          return true;
        });
        llmt::parallel_for(4, 4, [&](Eigen::Index) {
          Work part(work, 0.25);
          try {
            while (true) part.did(0.001);
          } catch (const watched::OwnError& error) {
            EXPECT_EQ(error.number, 7);
            ++ended;
            throw;
          }
        });
      },
      watched::OwnError);
  EXPECT_EQ(calls, 50);
  EXPECT_GE(ended, 1);
}

}  // namespace
