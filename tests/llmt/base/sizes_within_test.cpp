#include "base/sizes_within.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <vector>

namespace llmt {
namespace {

// A machine on which a task of a size takes size^power seconds and reports eight times a second.
struct Machine {
  double power = 1.0;
  double constant = 0.0;
  double now = 5.0;
  std::vector<Eigen::Index> ended = {};
  std::vector<Eigen::Index> begun = {};

  Eigen::Index largest(double seconds, const SizeRange& sizes, const Progress& told = {}) {
    return sizes_within(
        seconds, sizes,
        [this](Eigen::Index size, const Progress& progress) {
          begun.push_back(size);
          const double takes = constant + std::pow(static_cast<double>(size), power);
          const double begin = now;
          while (now - begin < takes) {
            now += 0.125;
            if (!progress({1, 10, ""})) throw Cancelled();
          }
          ended.push_back(size);
        },
        told, [this] { return now; });
  }
};

TEST(SizesWithin, AreAsLargeAsTheTimeAllows) {
  Machine machine;
  EXPECT_EQ(machine.largest(100.0, {4, 1000}), 67);  // 0.7 (100 - 4) / 4 = 16.8 times 4
  EXPECT_LT(machine.now, 105.0);
  EXPECT_EQ(machine.ended, machine.begun);  // 29 s were left, too few for half as many again
}

TEST(SizesWithin, EndAtTheLargestWhereTheTimeIsEnough) {
  Machine machine;
  EXPECT_EQ(machine.largest(1e6, {4, 1000}), 1000);
  EXPECT_EQ(machine.ended, (std::vector<Eigen::Index>{4, 1000}));
  // The last step may be a small one: with it the task is whole.
  Machine nearly;
  EXPECT_EQ(nearly.largest(100.0, {10, 12}), 12);
}

TEST(SizesWithin, GiveUpWhatIsLate) {
  Machine machine{.power = 2.0};
  EXPECT_EQ(machine.largest(100.0, {2, 1000}), 2);
  EXPECT_EQ(machine.begun, (std::vector<Eigen::Index>{2, 33}));
  EXPECT_EQ(machine.now, 105.125);  // and at once
  Machine foreseen{.power = 2.0};
  EXPECT_EQ(foreseen.largest(100.0, {2, 1000, 2.0}), 8);
  EXPECT_EQ(foreseen.begun, foreseen.ended);
}

TEST(SizesWithin, GrowInStepsWhereMostOfTheTimeIsConstant) {
  Machine machine{.constant = 20.0};
  EXPECT_GE(machine.largest(100.0, {1, 1000}), 3);
  EXPECT_LT(machine.now, 105.2);
}

TEST(SizesWithin, BeginWithTheLeastWhateverTheTime) {
  Machine machine;
  EXPECT_EQ(machine.largest(0.5, {4, 1000}), 4);
  EXPECT_EQ(machine.begun, (std::vector<Eigen::Index>{4}));
  Machine small;
  EXPECT_EQ(small.largest(100.0, {4, 2}), 2);  // more than there is to do
}

TEST(SizesWithin, TellHowMuchOfTheTimeIsOver) {
  Machine machine;
  std::vector<int> told;
  machine.largest(100.0, {4, 1000}, [&](const ProgressReport& report) {
    EXPECT_EQ(report.total, 1000);
    EXPECT_TRUE(told.empty() || report.done >= told.back());
    told.push_back(report.done);
    return true;
  });
  EXPECT_NEAR(told[told.size() - 2], 700, 20);
  EXPECT_EQ(told.back(), 1000);
  EXPECT_LT(told[told.size() - 2], 1000);
}

TEST(SizesWithin, AreCancelledByTheCaller) {
  Machine machine;
  int calls = 0;
  EXPECT_THROW(machine.largest(100.0, {4, 1000}, [&](const ProgressReport&) { return ++calls < 100; }), Cancelled);
  EXPECT_EQ(machine.ended, (std::vector<Eigen::Index>{4}));
}

TEST(SizesWithin, LetTheExceptionsOfTheTaskThrough) {
  const auto failing = [](Eigen::Index, const Progress&) { throw std::runtime_error("no rows"); };
  EXPECT_THROW(sizes_within(1.0, {1, 2}, failing, {}), std::runtime_error);
}

}  // namespace
}  // namespace llmt
