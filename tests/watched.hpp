// What every call with a progress promises.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "llmt/progress.hpp"

namespace watched {

/// Runs a call with this progress and returns all that it made, as text.
using Call = std::function<std::string(const llmt::Progress& progress)>;

inline std::vector<llmt::ProgressReport> reports_of(const Call& call) {
  std::vector<llmt::ProgressReport> reports;
  call([&](const llmt::ProgressReport& report) {
    reports.push_back(report);
    return true;
  });
  return reports;
}

/// `done` never falls, `total` stays, and the last report alone says that all is done.
inline void expect_rising(const std::vector<llmt::ProgressReport>& reports) {
  ASSERT_FALSE(reports.empty());
  int before = 0;
  for (std::size_t k = 0; k < reports.size(); ++k) {
    EXPECT_EQ(reports[k].total, reports[0].total);
    EXPECT_GE(reports[k].done, before);
    EXPECT_EQ(reports[k].done == reports[k].total, k + 1 == reports.size())
        << "report " << k << " of " << reports.size();
    before = reports[k].done;
  }
}

struct OwnError {
  int number = 0;
};

/// What the call throws if its callback says no in the k-th report, or throws there; then the callback is not called
/// again, and the call made anew returns what it did before. `every`: k goes in steps of this, and to the last report.
inline void expect_stops_at_every_report(const Call& call, int every = 1) {
  const std::string whole = call({});
  const int count = static_cast<int>(reports_of(call).size());
  for (int last = 1; last <= count; last = last < count ? std::min(count, last + every) : count + 1) {
    int calls = 0;
    EXPECT_THROW(call([&](const llmt::ProgressReport&) { return ++calls < last; }), llmt::Cancelled);
    EXPECT_EQ(calls, last);
    calls = 0;
    try {
      call([&](const llmt::ProgressReport&) {
        if (++calls == last) throw OwnError{last};
        return true;
      });
      ADD_FAILURE() << "nothing was thrown at report " << last;
    } catch (const OwnError& error) {
      EXPECT_EQ(error.number, last);
    }
    EXPECT_EQ(calls, last);
  }
  EXPECT_EQ(call({}), whole);
}

}  // namespace watched
