#include "llmt/folds.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "llmt/random.hpp"
#include "oracles/thrown.hpp"

namespace {

TEST(Folds, EveryRowIsHeldOutOnce) {
  for (const llmt::FoldKind kind : {llmt::FoldKind::random, llmt::FoldKind::contiguous}) {
    std::vector<int> held_out(103, 0);
    for (const llmt::Fold& fold : llmt::make_folds(103, {.count = 5, .kind = kind})) {
      EXPECT_EQ(fold.train.size() + fold.held_out.size(), 103U);
      EXPECT_GE(fold.held_out.size(), 20U);
      EXPECT_LE(fold.held_out.size(), 21U);
      for (const Eigen::Index row : fold.held_out) {
        ++held_out[row];
        EXPECT_FALSE(std::binary_search(fold.train.begin(), fold.train.end(), row));
      }
    }
    EXPECT_EQ(std::count(held_out.begin(), held_out.end(), 1), 103);
  }
}

TEST(Folds, ContiguousFoldsAreBlocks) {
  for (const llmt::Fold& fold : llmt::make_folds(50, {.count = 4, .kind = llmt::FoldKind::contiguous})) {
    EXPECT_EQ(fold.held_out.back() - fold.held_out.front() + 1, std::ssize(fold.held_out));
  }
}

TEST(Folds, GroupsStayTogether) {
  std::vector<double> pose(60);
  for (std::size_t i = 0; i < pose.size(); ++i) {
    pose[i] = static_cast<double>(i % 20);
  }
  for (const llmt::Fold& fold : llmt::make_folds(60, {.count = 5}, pose)) {
    EXPECT_EQ(fold.held_out.size(), 12U);
    for (const Eigen::Index row : fold.held_out) {
      EXPECT_TRUE(std::binary_search(fold.held_out.begin(), fold.held_out.end(), (row + 20) % 60));
    }
  }
}

TEST(Folds, SeedsChangeTheDealAndRepeatIt) {
  const auto first = [](std::uint64_t seed) { return llmt::make_folds(40, {.seed = seed})[0].held_out; };
  EXPECT_EQ(first(1), first(1));
  EXPECT_NE(first(1), first(2));
}

TEST(Folds, MistakesAreNamed) {
  EXPECT_EQ(oracle::thrown([] { llmt::make_folds(3, {.count = 5}); }),
            "llmt::make_folds: 5 folds need at least 5 rows (or groups), there are 3");
  EXPECT_EQ(oracle::thrown([] { llmt::make_folds(10, {.count = 1}); }),
            "llmt::make_folds: count is 1, it must be at least 2");
  const std::vector<double> labels(9, 1.0);
  EXPECT_EQ(oracle::thrown([&] { llmt::make_folds(10, {}, labels); }),
            "llmt::make_folds: groups has 9 labels for 10 rows");
}

TEST(Random, FollowsThePublishedGenerators) {
  // xoshiro256** from the state that splitmix64 makes of seed 0, evaluated by hand from the published recurrences:
  // splitmix64(0) begins e220a8397b1dcdaf, 6e789e6aa1b965f4, 06c45d188009454f, f88bb8a8724c81ec.
  llmt::Random random(0);
  const std::uint64_t s1 = 0x6e789e6aa1b965f4ULL;
  const std::uint64_t times5 = s1 * 5;
  EXPECT_EQ(random.bits(), ((times5 << 7) | (times5 >> 57)) * 9);
}

TEST(Random, MomentsAreThoseOfTheDistributions) {
  llmt::Random random(5);
  double sum = 0.0;
  double squares = 0.0;
  double fourth = 0.0;
  const int count = 200000;
  for (int i = 0; i < count; ++i) {
    const double value = random.normal();
    sum += value;
    squares += value * value;
    fourth += value * value * value * value;
  }
  // Five standard errors each.
  EXPECT_NEAR(sum / count, 0.0, 5.0 / std::sqrt(count));
  EXPECT_NEAR(squares / count, 1.0, 5.0 * std::sqrt(2.0 / count));
  EXPECT_NEAR(fourth / count, 3.0, 5.0 * std::sqrt(96.0 / count));
  std::vector<int> counts(7, 0);
  for (int i = 0; i < 70000; ++i) {
    ++counts[random.below(7)];
  }
  for (const int seen : counts) {
    EXPECT_NEAR(seen, 10000, 5.0 * std::sqrt(10000.0 * 6.0 / 7.0));
  }
}

}  // namespace
