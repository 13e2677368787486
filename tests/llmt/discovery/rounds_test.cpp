#include "llmt/discovery/rounds.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace llmt::discovery {
namespace {

struct Outcome {
  bool has_settled;
  int rounds;
};

Outcome play(const RoundLimits& limits, const std::vector<std::optional<RoundSummary>>& script) {
  int made = 0;
  const bool has_settled = until_settled(limits, {}, [&](int round) {
    EXPECT_EQ(round, made);
    ++made;
    return script.at(round);
  });
  return {has_settled, made};
}

const RoundSummary a{.names = {"a"}, .outliers = {}};
const RoundSummary b{.names = {"b"}, .outliers = {}};

TEST(Rounds, EndWhereTwoInARowAgree) {
  const Outcome outcome = play({.most = 9}, {a, b, b, a});
  EXPECT_TRUE(outcome.has_settled);
  EXPECT_EQ(outcome.rounds, 3);
}

TEST(Rounds, TheFirstIsComparedWithTheStart) {
  const Outcome outcome = play({.most = 9}, {RoundSummary{}});
  EXPECT_TRUE(outcome.has_settled);
  EXPECT_EQ(outcome.rounds, 1);
}

TEST(Rounds, ThatDoNotSettleEndAtTheLimitOrAtARepeat) {
  const Outcome all = play({.most = 4}, {a, b, a, b});
  EXPECT_FALSE(all.has_settled);
  EXPECT_EQ(all.rounds, 4);
  const Outcome circle = play({.most = 4, .stop_at_repeat = true}, {a, b, a, b});
  EXPECT_FALSE(circle.has_settled);
  EXPECT_EQ(circle.rounds, 3);
}

TEST(Rounds, TheSameNameTwiceIsAnotherResult) {
  const RoundSummary twice{.names = {"a", "a"}, .outliers = {}};
  EXPECT_FALSE(play({.most = 2}, {a, twice}).has_settled);
}

TEST(Rounds, FewOutliersMayDiffer) {
  const RoundSummary one{.names = {"a"}, .outliers = {1, 2}};
  const RoundSummary other{.names = {"a"}, .outliers = {2, 3}};
  EXPECT_FALSE(play({.most = 2, .negligible_outliers = 1}, {one, other}).has_settled);
  EXPECT_TRUE(play({.most = 2, .negligible_outliers = 2}, {one, other}).has_settled);
}

TEST(Rounds, ThatSayNothingOrAreNotTheLastDoNotSettle) {
  RoundSummary early = a;
  early.may_be_last = false;
  const Outcome outcome = play({.most = 9}, {a, early, std::nullopt, a});
  EXPECT_TRUE(outcome.has_settled);
  EXPECT_EQ(outcome.rounds, 4);
}

}  // namespace
}  // namespace llmt::discovery
