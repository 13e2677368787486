// Sums over rows: the same bytes whoever adds up which part.
#include "base/sum_over.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "oracles/oracles.hpp"

namespace {

using llmt::BlockSums;
using llmt::RowBlocks;
using llmt::RowSpan;

// One of every kind of sum.
struct Sums {
  double weight = 0.0;
  std::vector<double> columns;
  Eigen::MatrixXd gram;
  std::vector<llmt::Extent> extents;
  std::map<int, Eigen::VectorXd> of_kinds;  // of the rows of a kind; there is no entry for kinds without rows

  static auto fields(auto& self) { return std::tie(self.weight, self.columns, self.gram, self.extents, self.of_kinds); }
};

// Values of very different sizes, so that the order in which they are added shows.
Eigen::MatrixXd values_of(Eigen::Index rows, std::uint64_t seed) {
  const Eigen::MatrixXd exponents = 12.0 * oracle::uniform(rows, 3, seed);
  return oracle::uniform(rows, 3, seed + 1).cwiseProduct(exponents.array().exp().matrix());
}

Sums zero() {
  return {0.0, std::vector<double>(3, 0.0), Eigen::MatrixXd::Zero(3, 3), std::vector<llmt::Extent>(3), {}};
}

auto adds(const Eigen::MatrixXd& values) {
  return [&values](RowSpan block, Sums& sums) {
    for (Eigen::Index i = block.begin; i < block.end; ++i) {
      const Eigen::VectorXd row = values.row(i);
      sums.weight += std::abs(row(0));
      sums.gram += row * row.transpose();
      for (Eigen::Index j = 0; j < 3; ++j) {
        sums.columns[j] += row(j);
        sums.extents[j].widen(row(j));
      }
      const auto [kind, is_new] = sums.of_kinds.try_emplace(static_cast<int>(i / 1000));
      if (is_new) kind->second = Eigen::VectorXd::Zero(3);
      kind->second += row;
    }
  };
}

constexpr Eigen::Index counts_of_rows[] = {1, 2048, 2049, 3 * 2048, 11 * 2048, 20 * 2048 + 7, 64 * 2048};

TEST(SumOver, AnExtentWithoutValuesAddsNothing) {
  llmt::Extent some;
  some.widen(2.0);
  some.widen(3.0);
  llmt::Extent sum = some;
  sum += llmt::Extent();
  EXPECT_EQ(sum.low, 2.0);
  EXPECT_EQ(sum.high, 3.0);
  llmt::Extent nothing;
  nothing += llmt::Extent();
  EXPECT_FALSE(nothing.low <= nothing.high);
  nothing += some;
  EXPECT_EQ(nothing.low, 2.0);
  EXPECT_EQ(nothing.high, 3.0);
}

TEST(SumOver, IsTheSameOnAnyNumberOfThreads) {
  for (const Eigen::Index rows : counts_of_rows) {
    const Eigen::MatrixXd values = values_of(rows, 1);
    const std::string one = llmt::to_bytes(llmt::sum_over(RowBlocks{rows}, 1, zero(), adds(values)));
    for (const int threads : {2, 3, 8}) {
      EXPECT_EQ(llmt::to_bytes(llmt::sum_over(RowBlocks{rows}, threads, zero(), adds(values))), one)
          << rows << " rows, " << threads << " threads";
    }
  }
}

TEST(SumOver, IsTheSameIfWorkersSumRangesOfBlocksAndSendThemAsBytes) {
  for (const Eigen::Index rows : counts_of_rows) {
    const Eigen::MatrixXd values = values_of(rows, 2);
    const RowBlocks blocks{rows};
    const Eigen::Index count = blocks.count();
    const std::string whole = llmt::to_bytes(llmt::sum_over(blocks, 1, zero(), adds(values)));
    for (const Eigen::Index workers : {1, 2, 4, 7}) {
      BlockSums<Sums> all;
      for (Eigen::Index worker = 0; worker < workers; ++worker) {
        const std::string sent = llmt::to_bytes(
            llmt::sum_blocks(blocks, count * worker / workers, count * (worker + 1) / workers, zero(), adds(values)));
        all += llmt::from_bytes<BlockSums<Sums>>(sent);
      }
      EXPECT_EQ(llmt::to_bytes(std::move(all).total(count)), whole) << rows << " rows, " << workers << " workers";
    }
  }
}

// The tree as it is defined, from the top.
template <class Value>
Value tree_of(const std::vector<Value>& blocks, std::size_t first, std::size_t width) {
  if (width == 1) return blocks[first];
  const std::size_t half = width / 2;
  const Value left = tree_of(blocks, first, half);
  return first + half < blocks.size() ? left + tree_of(blocks, first + half, half) : left;
}

TEST(SumOver, AddsBlocksAsABinaryTree) {
  for (const Eigen::Index rows : counts_of_rows) {
    const Eigen::VectorXd values = values_of(rows, 3).col(0);
    std::vector<double> of_blocks;
    double in_order = 0.0;
    long double exact = 0.0;
    long double magnitude = 0.0;
    for (Eigen::Index i = 0; i < rows; ++i) {
      if (i % 2048 == 0) of_blocks.push_back(0.0);
      of_blocks.back() += values(i);
      in_order += values(i);
      exact += values(i);
      magnitude += std::abs(values(i));
    }
    const double sum = llmt::sum_of_rows(rows, [&](Eigen::Index i) { return values(i); });
    EXPECT_EQ(sum, tree_of(of_blocks, 0, 64)) << rows;
    if (rows > 10 * 2048) {
      EXPECT_NE(sum, in_order) << rows;  // or the comparisons of bytes would show nothing
    }
    // A number goes through at most 2048 additions in its block and 6 in the tree, each right to half a unit in the
    // last place of what it gives.
    EXPECT_LE(std::abs(static_cast<double>(sum - exact)), 2054 * 0x1p-53 * static_cast<double>(magnitude)) << rows;
  }
}

TEST(SumOver, OfNoRowsIsZero) {
  EXPECT_EQ(llmt::sum_of_rows(0, [](Eigen::Index) { return 1.0; }), 0.0);
}

TEST(SumOver, HoldsTwoSumsForEachLevelOfTheTreeAtMost) {
  const auto count = [](RowSpan block, double& sum) { sum += static_cast<double>(block.count()); };
  const std::string sent = llmt::to_bytes(llmt::sum_blocks(RowBlocks{300 * 2048}, 1, 299, 0.0, count));
  EXPECT_LE(sent.size(), 8 + 2 * 8 * 3 * sizeof(double));  // 256 blocks in the middle need 8 levels
}

TEST(SumOver, RefusesRangesThatDoNotFollowEachOther) {
  const auto count = [](RowSpan block, double& sum) { sum += static_cast<double>(block.count()); };
  const RowBlocks blocks{10 * 2048};
  BlockSums<double> sums = llmt::sum_blocks(blocks, 0, 4, 0.0, count);
  EXPECT_THROW(sums += llmt::sum_blocks(blocks, 5, 10, 0.0, count), std::invalid_argument);
  EXPECT_THROW(std::move(sums).total(10), std::invalid_argument);
  EXPECT_THROW(llmt::sum_blocks(blocks, 4, 10, 0.0, count).total(10), std::invalid_argument);
}

TEST(SumOver, RefusesBytesThatAreCutOffOrTooMany) {
  const Eigen::MatrixXd values = values_of(5000, 5);
  const std::string bytes = llmt::to_bytes(llmt::sum_blocks(RowBlocks{5000}, 0, 3, zero(), adds(values)));
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_THROW(llmt::from_bytes<BlockSums<Sums>>(std::string_view(bytes).substr(0, size)), std::runtime_error)
        << size;
  }
  EXPECT_THROW(llmt::from_bytes<BlockSums<Sums>>(bytes + '\0'), std::runtime_error);
}

TEST(SumOver, BytesOfAMatrixAreNoVector) {
  EXPECT_EQ(llmt::from_bytes<Eigen::VectorXd>(llmt::to_bytes(Eigen::VectorXd(3))).size(), 3);
  for (const Eigen::MatrixXd& matrix : {Eigen::MatrixXd(3, 0), Eigen::MatrixXd(3, 2)}) {
    EXPECT_THROW(llmt::from_bytes<Eigen::VectorXd>(llmt::to_bytes(matrix)), std::runtime_error);
  }
}

}  // namespace
