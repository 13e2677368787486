// The share of a computation that is done.
#include "base/work.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace {

using llmt::Stage;
using llmt::Work;

struct Watched {
  std::vector<double> shares;
  double operations = 0.0;
  Work work = Work([this](double share, double all) {
    shares.push_back(share);
    operations = all;
  });
};

TEST(Work, TheShareGoesWithTheOperationsWhereTheEstimateIsRight) {
  Watched watched;
  const Stage first = watched.work.stage(30.0);
  const Stage second = watched.work.stage(70.0);
  first.did(10.0);
  second.did(35.0);  // stages may go on at the same time
  first.did(20.0);
  ASSERT_EQ(watched.shares.size(), 3U);
  EXPECT_NEAR(watched.shares[0], 0.10, 1e-12);
  EXPECT_NEAR(watched.shares[1], 0.45, 1e-12);
  EXPECT_NEAR(watched.shares[2], 0.65, 1e-12);
  EXPECT_EQ(watched.operations, 65.0);
  EXPECT_EQ(second.to_come(), 35.0);
}

TEST(Work, AnotherEstimateOfTheRestDoesNotMoveTheShare) {
  Watched watched;
  const Stage first = watched.work.stage(50.0);
  const Stage second = watched.work.stage(50.0);
  first.did(50.0);
  EXPECT_NEAR(watched.shares.back(), 0.5, 1e-12);
  second.expect(200.0);
  second.did(100.0);
  EXPECT_NEAR(watched.shares.back(), 0.75, 1e-12);
  second.expect(10.0);
  second.did(5.0);
  EXPECT_NEAR(watched.shares.back(), 0.875, 1e-12);
}

TEST(Work, MoreThanWasExpectedMovesTheShareLittleAndNeverToItsEnd) {
  Watched watched;
  const Stage stage = watched.work.stage(10.0);
  for (int step = 0; step < 5; ++step) stage.did(9.5);
  for (std::size_t k = 1; k < watched.shares.size(); ++k) EXPECT_GT(watched.shares[k], watched.shares[k - 1]);
  EXPECT_LT(watched.shares.back(), 1.0);
}

TEST(Work, AStageWithoutWorkCountsNothing) {
  const Stage none;
  none.expect(3.0);
  none.did(2.0);
  EXPECT_EQ(none.to_come(), 0.0);
  EXPECT_EQ(none.another(5.0).to_come(), 0.0);
}

}  // namespace
