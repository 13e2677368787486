#include "estimation/sums/assembly.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <span>
#include <tuple>

#include "base/count.hpp"
#include "base/simd.hpp"
#include "base/sum_over.hpp"
#include "estimation/sums/active_rows.hpp"
#include "estimation/sums/missing_by_validity.hpp"
#include "estimation/sums/rows_by_leaf.hpp"

namespace llmt {
namespace {

// The range in which a leaf's slopes count reaches beyond its outermost rows by this part of the range of its rows.
// Thresholds lie between rows, so queries of the leaf may be half a step outside of its rows.
constexpr double range_margin = 0.25;

// Logistic gates give every leaf some validity at every row. Only rows with more than this count in a leaf's range.
constexpr double reach_of_logistic = 1e-3;

// Rows of a block that are laid out together: few enough that they stay in the cache.
constexpr Eigen::Index rows_of_lot = 128;

// Most numbers that their outer products take: 2 MiB.
constexpr Eigen::Index outer_products = Eigen::Index{1} << 18;

constexpr double unbounded = std::numeric_limits<double>::infinity();

// Sums that are formed at once.
constexpr Eigen::Index leaves_at_once = 4;
static_assert(leaves_at_once <= ActiveRows::more_columns);

// Rows of outer products times a factor for each use, laid out as in ActiveRows, one row for each use; and their sum.
template <class Lanes>
LLMT_INLINE void scale_rows(std::span<const ActiveRows::Use> uses, const std::vector<double>& factors,
                            const ActiveRows& active, std::vector<double>& scaled, double* sum) {
  const Eigen::Index count = std::ssize(uses);
  const Eigen::Index strip = active.chunk.count() * lanes;
  double* out = scaled.data();
  for (const double* in = active.outer.data(); out != scaled.data() + scaled.size(); in += strip, sum += lanes) {
    Lanes total = {};
    for (Eigen::Index u = 0; u < count; ++u, out += lanes) {
      const Lanes product = factors[u] * *reinterpret_cast<const Lanes*>(in + uses[u].row * lanes);
      *reinterpret_cast<Lanes*>(out) = product;
      total += product;
    }
    *reinterpret_cast<Lanes*>(sum) += total;
  }
}

// Sums over the uses of a leaf of validity x row, for the validities of `leaves_at_once` leaves from `column` on.
// `sums`: leaves_at_once x padded numbers.
template <class Lanes>
LLMT_INLINE void sum_tile(std::span<const ActiveRows::Use> uses, const RowMajor& validities, Eigen::Index column,
                          const std::vector<double>& scaled, double* sums) {
  const Eigen::Index numbers = std::ssize(scaled) / std::ssize(uses);
  const double* row = scaled.data();
  for (Eigen::Index begin = 0; begin < numbers; begin += lanes) {
    Lanes sum[leaves_at_once] = {};
    for (const ActiveRows::Use& use : uses) {
      const double* validity = validities.data() + use.row * validities.cols() + column;
      const Lanes of_row = *reinterpret_cast<const Lanes*>(row);
      for (Eigen::Index t = 0; t < leaves_at_once; ++t) {
        sum[t] += validity[t] * of_row;
      }
      row += lanes;
    }
    for (Eigen::Index t = 0; t < leaves_at_once; ++t) {
      *reinterpret_cast<Lanes*>(sums + t * numbers + begin) = sum[t];
    }
  }
}

LLMT_FOR_EACH_INSTRUCTION_SET
void add_numbers(const double* from, Eigen::Index count, double* to) {
  for (Eigen::Index k = 0; k < count; ++k) {
    to[k] += from[k];
  }
}

// Widens ranges to `values`, of which NaN, a missing one, widens none.
LLMT_FOR_EACH_INSTRUCTION_SET
void widen(const double* values, Eigen::Index count, double* low, double* high) {
  for (Eigen::Index k = 0; k < count; ++k) {
    low[k] = values[k] < low[k] ? values[k] : low[k];
    high[k] = values[k] > high[k] ? values[k] : high[k];
  }
}

std::span<const ActiveRows::Use> uses_of(const ActiveRows& active, std::size_t leaf) {
  return {active.uses.begin() + active.first_use[leaf], active.uses.begin() + active.first_use[leaf + 1]};
}

// The range of the regressors over some rows.
struct Range {
  Eigen::VectorXd low;
  Eigen::VectorXd high;

  Range& operator+=(const Range& other) {
    low = low.cwiseMin(other.low);
    high = high.cwiseMax(other.high);
    return *this;
  }
  static auto fields(auto& self) { return std::tie(self.low, self.high); }
};

// Sums over the rows that a leaf reaches.
struct SumsOfLeaf {
  std::vector<double> gram;  // lower triangle row by row, padded; with missing values in full
  Eigen::MatrixXd products;
  Eigen::VectorXd squares;
  Range range;
  std::map<int, std::vector<double>> blocks;  // NormalEquations::blocks

  static auto fields(auto& self) { return std::tie(self.gram, self.products, self.squares, self.range, self.blocks); }
};

// The sums of every leaf that reaches one of the rows.
using SumsOfLeaves = std::map<int, SumsOfLeaf>;

// One pass over the rows that forms the sums.
class Assembly {
 public:
  Assembly(const TrainingRows& training, Partition& partition, const Eigen::MatrixXd& root, int max_threads);

  NormalEquations run(int max_threads);

 private:
  SumsOfLeaf nothing() const;
  void widen_range(const ActiveRows& active, int leaf, SumsOfLeaf& sums) const;
  void add(const ActiveRows& active, int leaf, SumsOfLeaf& sums) const;
  void add_with_missing(const ActiveRows& active, int leaf, SumsOfLeaf& sums) const;
  NormalEquations equations_from(SumsOfLeaves sums);
  Eigen::MatrixXd unpacked(const std::vector<double>& gram) const;
  void set_range(const Range& range, Node& node) const;

  const TrainingRows& training_;
  Partition& partition_;
  const Eigen::MatrixXd& root_;
  const Eigen::Index size_;    // coefficients of a local model
  const Eigen::Index packed_;  // numbers that a block is stored in
  const Evaluator evaluator_;
  const std::vector<int> leaves_;  // from left to right
  std::vector<int> leaf_of_node_;
  const PartitionContext by_;
};

Assembly::Assembly(const TrainingRows& training, Partition& partition, const Eigen::MatrixXd& root, int max_threads)
    : training_(training),
      partition_(partition),
      root_(root),
      size_(std::ssize(training.regressors) + 1),
      packed_(training.has_missing ? size_ * size_ : size_ * (size_ + 1) / 2),
      evaluator_(partition, training.columns, std::ssize(training.regressors)),
      leaves_(leaves_from_left(partition)),
      leaf_of_node_(partition.nodes.size(), -1),
      by_{training,      partition, evaluator_,
          leaf_of_node_, root,      leaves_out_ambiguous(training, evaluator_, max_threads)} {
  for (int leaf = 0; leaf < count_of(leaves_); ++leaf) leaf_of_node_[leaves_[leaf]] = leaf;
}

NormalEquations Assembly::run(int max_threads) {
  // Logistic gates take the mean of the input for a missing value, as their local models do.
  const ValidityKind kind = partition_.validity.kind;
  const bool overlap = kind == ValidityKind::blend || kind == ValidityKind::gaussian;
  const bool missing = training_.has_missing;
  if (overlap && missing) {
    describe_missing_by_validity(training_, evaluator_, by_.leaves_out_ambiguous, partition_, max_threads);
  }
  // In the order of the leaves: few leaves reach the rows of a block, and the others take no part in its sums.
  const std::vector<int> rows = rows_by_leaf(training_, partition_, evaluator_, max_threads);
  const Eigen::Index of_lot = std::clamp<Eigen::Index>(outer_products / packed_, 1, rows_of_lot);
  const auto add_block = [&](RowSpan block, SumsOfLeaves& sums) {
    for (Eigen::Index begin = block.begin; begin < block.end; begin += of_lot) {
      const auto first = rows.begin() + begin;
      const ActiveRows active = active_rows(by_, {first, first + std::min(of_lot, block.end - begin)});
      for (const int leaf : active.leaves) {
        const auto [at, is_new] = sums.try_emplace(leaf);
        if (is_new) at->second = nothing();
        widen_range(active, leaf, at->second);
        if (missing) {
          add_with_missing(active, leaf, at->second);
        } else {
          add(active, leaf, at->second);
        }
      }
    }
  };
  NormalEquations result =
      equations_from(sum_over(RowBlocks{std::ssize(rows)}, max_threads, SumsOfLeaves{}, add_block));
  if (overlap && !missing) describe_missing_by_sums(result, training_.scale, partition_);
  return result;
}

SumsOfLeaf Assembly::nothing() const {
  return {std::vector<double>(padded_to_lanes(packed_), 0.0),
          Eigen::MatrixXd::Zero(size_, root_.cols()),
          Eigen::VectorXd::Zero(root_.cols()),
          {Eigen::VectorXd::Constant(size_ - 1, unbounded), Eigen::VectorXd::Constant(size_ - 1, -unbounded)},
          {}};
}

void Assembly::widen_range(const ActiveRows& active, int leaf, SumsOfLeaf& sums) const {
  const double least = partition_.validity.kind == ValidityKind::logistic ? reach_of_logistic : 0.0;
  for (const ActiveRows::Use& use : uses_of(active, leaf)) {
    if (!(active.entries[use.entry].validity > least)) continue;
    widen(active.chunk.deviations.row(use.row).data(), size_ - 1, sums.range.low.data(), sums.range.high.data());
  }
}

// Adds the rows of a leaf to its sums and to its blocks with the leaves before it.
void Assembly::add(const ActiveRows& active, int leaf, SumsOfLeaf& sums) const {
  const std::span<const ActiveRows::Use> uses = uses_of(active, leaf);
  thread_local std::vector<double> factors;  // these three are kept for their memory
  thread_local std::vector<double> scaled;
  thread_local std::vector<double> of_lot;
  factors.clear();
  Eigen::Index first = active.column[leaf];
  for (const ActiveRows::Use& use : uses) {
    const double weight = active.chunk.weights(use.row) * active.entries[use.entry].validity;
    factors.push_back(weight);
    first = std::min(first, active.column[active.entries[use.before].leaf]);
    for (Eigen::Index o = 0; o < root_.cols(); ++o) {
      const double residual = active.residuals(use.row, o);
      sums.squares(o) += weight * residual * residual;
      sums.products.col(o) += weight * residual * active.regressors.row(use.row).transpose();
    }
  }
  scaled.resize(std::ssize(active.outer) / active.chunk.count() * std::ssize(uses));
  with_widest_registers([&](auto eight) LLMT_INLINE_LAMBDA {
    scale_rows<decltype(eight)>(uses, factors, active, scaled, sums.gram.data());
  });
  const Eigen::Index numbers = padded_to_lanes(packed_);
  of_lot.resize(leaves_at_once * numbers);
  auto next = sums.blocks.lower_bound(active.leaves[first]);
  for (Eigen::Index column = first; column <= active.column[leaf]; column += leaves_at_once) {
    with_widest_registers([&](auto eight) LLMT_INLINE_LAMBDA {
      sum_tile<decltype(eight)>(uses, active.validities, column, scaled, of_lot.data());
    });
    for (Eigen::Index k = column; k < std::min(column + leaves_at_once, active.column[leaf] + 1); ++k) {
      const double* sum = of_lot.data() + (k - column) * numbers;
      // The sum of the products of validities: 0 where the leaves share no row.
      if (!(sum[0] > 0.0)) continue;
      next = sums.blocks.try_emplace(next, active.leaves[k]);
      next->second.resize(packed_, 0.0);
      add_numbers(sum, packed_, next->second.data());
      ++next;
    }
  }
}

void Assembly::add_with_missing(const ActiveRows& active, int leaf, SumsOfLeaf& sums) const {
  using Square = Eigen::Map<RowMajor>;
  for (const ActiveRows::Use& use : uses_of(active, leaf)) {
    const Eigen::VectorXd x = regressors_at(by_, active.chunk, use.row, leaves_[leaf]);
    const double weight = active.chunk.weights(use.row) * active.entries[use.entry].validity;
    for (Eigen::Index e = use.before; e <= use.entry; ++e) {
      const ActiveRows::Entry& entry = active.entries[e];
      const Eigen::VectorXd of_other = regressors_at(by_, active.chunk, use.row, leaves_[entry.leaf]);
      std::vector<double>& block = sums.blocks[entry.leaf];
      block.resize(packed_, 0.0);
      Square(block.data(), size_, size_) += (weight * entry.validity * x) * of_other.transpose();
    }
    Square(sums.gram.data(), size_, size_) += weight * x * x.transpose();
    sums.products += weight * x * active.residuals.row(use.row);
    sums.squares += weight * active.residuals.row(use.row).cwiseAbs2().transpose();
  }
}

Eigen::MatrixXd Assembly::unpacked(const std::vector<double>& gram) const {
  if (training_.has_missing) return Eigen::Map<const RowMajor>(gram.data(), size_, size_);
  Eigen::MatrixXd result(size_, size_);
  const double* value = gram.data();
  for (Eigen::Index i = 0; i < size_; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) result(i, j) = result(j, i) = *value++;
  }
  return result;
}

// The sums and ranges of all nodes: those of inner nodes from those of their children.
NormalEquations Assembly::equations_from(SumsOfLeaves sums) {
  const std::size_t nodes = partition_.nodes.size();
  NormalEquations result{.size = size_,
                         .missing = training_.has_missing,
                         .leaves = leaves_,
                         .blocks = std::vector<std::map<int, std::vector<double>>>(leaves_.size()),
                         .gram = std::vector(nodes, Eigen::MatrixXd(Eigen::MatrixXd::Zero(size_, size_))),
                         .products = std::vector(nodes, nothing().products),
                         .squares = std::vector(nodes, nothing().squares)};
  std::vector<Range> ranges(nodes, nothing().range);
  for (auto& [leaf, of_leaf] : sums) {
    const int node = leaves_[leaf];
    result.blocks[leaf] = std::move(of_leaf.blocks);
    result.gram[node] = unpacked(of_leaf.gram);
    result.products[node] = std::move(of_leaf.products);
    result.squares[node] = std::move(of_leaf.squares);
    ranges[node] = std::move(of_leaf.range);
  }
  const std::vector<int> parents = parents_of(partition_);
  for (std::size_t i = nodes; i-- > 0;) {
    set_range(ranges[i], partition_.nodes[i]);
    if (i == 0) break;
    const std::size_t parent = parents[i];
    result.gram[parent] += result.gram[i];
    result.products[parent] += result.products[i];
    result.squares[parent] += result.squares[i];
    ranges[parent] += ranges[i];
  }
  return result;
}

// Widens the range by the margin.
void Assembly::set_range(const Range& range, Node& node) const {
  for (Eigen::Index k = 0; k < size_ - 1; ++k) {
    if (!(range.low(k) <= range.high(k))) continue;
    const double margin = range_margin * (range.high(k) - range.low(k));
    node.low(k) = std::clamp(range.low(k) - margin, training_.spread(0, k), training_.spread(1, k));
    node.high(k) = std::clamp(range.high(k) + margin, training_.spread(0, k), training_.spread(1, k));
  }
}

}  // namespace

bool leaves_out_ambiguous(const TrainingRows& training, const Evaluator& evaluator, int max_threads) {
  if (!training.has_missing) return false;
  const auto add = [&](const Chunk& chunk, WeightedMean& sum) {
    for (Eigen::Index r = 0; r < chunk.count(); ++r) {
      sum.add(evaluator.is_ambiguous(chunk.inputs.row(r).data()) ? 1.0 : 0.0, chunk.weights(r));
    }
  };
  const double part = sum_over(training, {}, max_threads, WeightedMean{}, add).value();
  // If they are most of the data, they are better than nothing.
  return part > 0.0 && part <= 0.5;
}

NormalEquations assemble(const TrainingRows& training, Partition& partition, const Eigen::MatrixXd& root,
                         int max_threads) {
  return Assembly(training, partition, root, max_threads).run(max_threads);
}

}  // namespace llmt
