/// \file
/// The one rule by which the library adds up rows (docs/algorithms/numerics.md, "Sums over rows").
///
/// Rows are cut into blocks of fixed size by their numbers. The rows of a block are added in their order. The sums of
/// the blocks are added as a binary tree: blocks 2 k and 2 k + 1, then these pairs in pairs, and so on. The tree
/// depends on the number of blocks alone. So the result is the same, to the byte, whoever adds up which part of the
/// tree: threads here, or processes that send each other BlockSums.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <bit>
#include <cstdint>
#include <stdexcept>
#include <utility>
#include <vector>

#include "base/parallel.hpp"
#include "base/sums.hpp"

namespace llmt {

/// Rows of a block.
inline constexpr Eigen::Index block_rows = 2048;

/// The same for sums that take more memory than the rows of a small block, such as those of all bins.
inline constexpr Eigen::Index large_block_rows = 65536;

/// The rows begin ... end - 1.
struct RowSpan {
  Eigen::Index begin = 0;
  Eigen::Index end = 0;

  Eigen::Index count() const { return end - begin; }
};

/// Rows 0 ... rows - 1 in blocks.
struct RowBlocks {
  Eigen::Index rows = 0;
  Eigen::Index size = block_rows;

  Eigen::Index count() const { return (rows + size - 1) / size; }
  RowSpan operator[](Eigen::Index k) const { return {k * size, std::min(rows, (k + 1) * size)}; }
};

/// The sum over a range of blocks, added up as far as the tree of all blocks adds up inside the range: at most two sums
/// for each level of the tree.
template <class Sum>
class BlockSums {
 public:
  /// Adds a block's sum behind those that are there. Throws std::invalid_argument if it is not that of the next block.
  void push(Eigen::Index block, Sum sum) { push({block, 1, std::move(sum)}); }

  /// Adds the sums of the range behind this one. Throws std::invalid_argument if it is not the next range.
  BlockSums& operator+=(BlockSums next) {
    for (Part& part : next.parts_) push(std::move(part));
    return *this;
  }

  /// The sum over the blocks 0 ... blocks - 1. Throws std::invalid_argument if the range does not consist of these.
  Sum total(Eigen::Index blocks) && {
    if (parts_.empty() || parts_.front().first != 0 || parts_.back().end() != blocks) {
      throw std::invalid_argument("llmt: sums of some blocks are missing");
    }
    // The parts at the end of the rows that have no neighbour of their size are merged from the smallest one on.
    for (; parts_.size() > 1; parts_.pop_back()) merge(parts_[parts_.size() - 2].sum, std::move(parts_.back().sum));
    return std::move(parts_.front().sum);
  }

  static auto fields(auto& self) { return std::tie(self.parts_); }

 private:
  /// The sum over blocks first ... first + blocks - 1, a node of the tree: `blocks` is a power of two that divides
  /// `first`.
  struct Part {
    Eigen::Index first = 0;
    Eigen::Index blocks = 0;
    Sum sum{};

    Eigen::Index end() const { return first + blocks; }
    static auto fields(auto& self) { return std::tie(self.first, self.blocks, self.sum); }
  };

  void push(Part part) {
    if (!parts_.empty() && parts_.back().end() != part.first) {
      throw std::invalid_argument("llmt: sums of blocks that do not follow each other");
    }
    while (!parts_.empty() && parts_.back().blocks == part.blocks && parts_.back().first % (2 * part.blocks) == 0) {
      Part left = std::move(parts_.back());
      parts_.pop_back();
      merge(left.sum, std::move(part.sum));
      left.blocks *= 2;
      part = std::move(left);
    }
    parts_.push_back(std::move(part));
  }

  std::vector<Part> parts_;  // in the order of their rows
};

/// The sums of the blocks first ... last - 1. `add(RowSpan, Sum&)` adds the rows of a block to a sum that is `zero`.
template <class Sum, class Add>
BlockSums<Sum> sum_blocks(const RowBlocks& blocks, Eigen::Index first, Eigen::Index last, Sum zero, const Add& add) {
  BlockSums<Sum> sums;
  for (Eigen::Index block = first; block < last; ++block) {
    Sum sum = block + 1 < last ? zero : std::move(zero);
    add(blocks[block], sum);
    sums.push(block, std::move(sum));
  }
  return sums;
}

/// The sum over all rows, the same at any number of threads. `add` as for sum_blocks(); it may be called by several
/// threads at once. Holds 16 sums and one for each level of the tree and thread, at most.
template <class Sum, class Add>
Sum sum_over(const RowBlocks& blocks, int max_threads, Sum zero, const Add& add) {
  constexpr Eigen::Index most_ranges = 16;
  const Eigen::Index count = blocks.count();
  if (count == 0) return zero;
  const Eigen::Index least = max_threads == 1 ? count : (count + most_ranges - 1) / most_ranges;
  const auto of_range = static_cast<Eigen::Index>(std::bit_ceil(static_cast<std::uint64_t>(least)));
  const Eigen::Index ranges = (count + of_range - 1) / of_range;
  if (ranges == 1) return sum_blocks(blocks, 0, count, std::move(zero), add).total(count);
  std::vector<BlockSums<Sum>> sums(ranges);
  parallel_for(ranges, max_threads, [&](Eigen::Index k) {
    sums[k] = sum_blocks(blocks, k * of_range, std::min(count, (k + 1) * of_range), zero, add);
  });
  for (Eigen::Index k = 1; k < ranges; ++k) sums[0] += std::move(sums[k]);
  return std::move(sums[0]).total(count);
}

/// The sum of term(i) over the rows i.
template <class Term>
double sum_of_rows(Eigen::Index rows, const Term& term, int max_threads = 1) {
  return sum_over(RowBlocks{rows}, max_threads, 0.0, [&](RowSpan block, double& sum) {
    for (Eigen::Index i = block.begin; i < block.end; ++i) sum += term(i);
  });
}

}  // namespace llmt
