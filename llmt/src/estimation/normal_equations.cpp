#include "estimation/normal_equations.hpp"

#include <algorithm>
#include <limits>
#include <span>

#include "base/count.hpp"
#include "base/parallel.hpp"
#include "base/simd.hpp"
#include "estimation/missing_by_validity.hpp"
#include "estimation/reached_rows.hpp"
#include "estimation/rows_by_leaf.hpp"
#include "model/evaluator.hpp"

namespace llmt {
namespace {

// The range in which a leaf's slopes count reaches beyond its outermost rows by this part of the range of its rows.
// Thresholds lie between rows, so queries of the leaf may be half a step outside of its rows.
constexpr double range_margin = 0.25;

// Logistic gates give every leaf some validity at every row. Only rows with more than this count in a leaf's range.
constexpr double reach_of_logistic = 1e-3;

// Rows that are laid out together, and how many such lots are taken at once.
constexpr Eigen::Index rows_of_lot = 128;
constexpr Eigen::Index lots_at_once = 32;

// Most numbers that the outer products of the rows taken at once take: 64 MiB.
constexpr Eigen::Index outer_products = Eigen::Index{1} << 23;

constexpr double infinity = std::numeric_limits<double>::infinity();

// Sums that are formed at once.
constexpr Eigen::Index tile = 4;
static_assert(tile <= ReachedRows::more_columns);

// Rows of outer products times a factor for each use, laid out as in ReachedRows, one row for each use; and their sum.
LLMT_FOR_EACH_INSTRUCTION_SET
void scale_rows(std::span<const ReachedRows::Use> uses, const std::vector<double>& factors, const ReachedRows& reached,
                std::vector<double>& scaled, double* sum) {
  const Eigen::Index count = std::ssize(uses);
  const Eigen::Index strip = reached.chunk.count() * lanes;
  scaled.resize(std::ssize(reached.outer) / reached.chunk.count() * count);
  double* out = scaled.data();
  for (const double* in = reached.outer.data(); out != scaled.data() + scaled.size(); in += strip, sum += lanes) {
    Lanes total = {};
    for (Eigen::Index u = 0; u < count; ++u, out += lanes) {
      const Lanes product = factors[u] * *reinterpret_cast<const Lanes*>(in + uses[u].row * lanes);
      *reinterpret_cast<Lanes*>(out) = product;
      total += product;
    }
    *reinterpret_cast<Lanes*>(sum) += total;
  }
}

// Sums over the uses of a leaf of validity x row, for the validities of `tile` leaves from `column` on. `sums`: tile x
// padded numbers.
LLMT_FOR_EACH_INSTRUCTION_SET
void sum_tile(std::span<const ReachedRows::Use> uses, const RowMajor& validities, Eigen::Index column,
              const std::vector<double>& scaled, double* sums) {
  const Eigen::Index numbers = std::ssize(scaled) / std::ssize(uses);
  const double* row = scaled.data();
  for (Eigen::Index begin = 0; begin < numbers; begin += lanes) {
    Lanes sum[tile] = {};
    for (const ReachedRows::Use& use : uses) {
      const double* validity = validities.data() + use.row * validities.cols() + column;
      const Lanes of_row = *reinterpret_cast<const Lanes*>(row);
      for (Eigen::Index t = 0; t < tile; ++t) {
        sum[t] += validity[t] * of_row;
      }
      row += lanes;
    }
    for (Eigen::Index t = 0; t < tile; ++t) {
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

std::span<const ReachedRows::Use> uses_of(const ReachedRows& reached, std::size_t leaf) {
  return {reached.uses.begin() + reached.first_use[leaf], reached.uses.begin() + reached.first_use[leaf + 1]};
}

// One pass over the rows that forms the sums.
class Assembly {
 public:
  Assembly(const TrainingRows& training, Partition& partition, const Eigen::MatrixXd& root);

  NormalEquations run(int max_threads);

 private:
  void widen_range(const ReachedRows& reached, std::size_t leaf);
  std::vector<double>& block_to_add_to(std::size_t leaf, std::size_t other);
  void add(const ReachedRows& reached, std::size_t leaf);
  void add_with_missing(const ReachedRows& reached, std::size_t leaf);
  void unpack_gram();
  void add_up_to_parents();

  const TrainingRows& training_;
  Partition& partition_;
  const Eigen::MatrixXd& root_;
  const Eigen::Index size_;    // coefficients of a local model
  const Eigen::Index packed_;  // numbers that a block is stored in
  const Evaluator evaluator_;
  std::vector<int> leaf_of_node_;
  const ReachedBy by_;
  NormalEquations sums_;
  std::vector<std::vector<double>> packed_gram_;  // of every leaf, lower triangle row by row, padded
  std::vector<Eigen::VectorXd> low_;              // of every node
  std::vector<Eigen::VectorXd> high_;
};

Assembly::Assembly(const TrainingRows& training, Partition& partition, const Eigen::MatrixXd& root)
    : training_(training),
      partition_(partition),
      root_(root),
      size_(std::ssize(training.regressors) + 1),
      packed_(training.has_missing ? size_ * size_ : size_ * (size_ + 1) / 2),
      evaluator_(partition, training.columns, std::ssize(training.regressors)),
      leaf_of_node_(partition.nodes.size(), -1),
      by_{training, partition, evaluator_, leaf_of_node_, root, leaves_out_ambiguous(training, evaluator_)} {
  const int nodes = count_of(partition.nodes);
  sums_.size = size_;
  sums_.missing = training.has_missing;
  sums_.leaves = leaves_from_left(partition);
  for (const int node : sums_.leaves) {
    leaf_of_node_[node] = count_of(sums_.blocks);
    sums_.blocks.emplace_back(sums_.blocks.size() + 1);
    packed_gram_.emplace_back(training.has_missing ? 0 : padded_to_lanes(packed_), 0.0);
  }
  sums_.gram.assign(nodes, Eigen::MatrixXd::Zero(size_, size_));
  sums_.products.assign(nodes, Eigen::MatrixXd::Zero(size_, root.cols()));
  sums_.squares.assign(nodes, Eigen::VectorXd::Zero(root.cols()));
  low_.assign(nodes, Eigen::VectorXd::Constant(size_ - 1, infinity));
  high_.assign(nodes, Eigen::VectorXd::Constant(size_ - 1, -infinity));
}

NormalEquations Assembly::run(int max_threads) {
  // Logistic gates take the mean of the input for a missing value, as their local models do.
  const ValidityKind kind = partition_.validity.kind;
  const bool overlap = kind == ValidityKind::blend || kind == ValidityKind::gaussian;
  if (overlap && sums_.missing) {
    describe_missing_by_validity(training_, evaluator_, by_.leaves_out_ambiguous, partition_);
  }
  const Eigen::Index of_lot = std::clamp<Eigen::Index>(outer_products / (lots_at_once * packed_), 1, rows_of_lot);
  const std::vector<int> rows = rows_by_leaf(training_, partition_, evaluator_, max_threads);
  for (Eigen::Index begin = 0; begin < std::ssize(rows); begin += lots_at_once * of_lot) {
    const Eigen::Index left = std::ssize(rows) - begin;
    std::vector<ReachedRows> lots(std::min(lots_at_once, (left + of_lot - 1) / of_lot));
    parallel_for(std::ssize(lots), max_threads, [&](Eigen::Index lot) {
      const auto first = rows.begin() + begin + lot * of_lot;
      lots[lot] = reach(by_, {first, first + std::min(of_lot, rows.end() - first)});
    });
    // Leaves are independent: each adds to its own sums and to its blocks with the leaves before it.
    parallel_for(std::ssize(sums_.leaves), max_threads, [&](Eigen::Index leaf) {
      for (const ReachedRows& reached : lots) {
        widen_range(reached, leaf);
        if (sums_.missing) {
          add_with_missing(reached, leaf);
        } else {
          add(reached, leaf);
        }
      }
    });
  }
  if (!sums_.missing) unpack_gram();
  add_up_to_parents();
  if (overlap && !sums_.missing) describe_missing_by_sums(sums_, training_.scale, partition_);
  return std::move(sums_);
}

void Assembly::widen_range(const ReachedRows& reached, std::size_t leaf) {
  const std::size_t node = sums_.leaves[leaf];
  const double least = partition_.validity.kind == ValidityKind::logistic ? reach_of_logistic : 0.0;
  for (const ReachedRows::Use& use : uses_of(reached, leaf)) {
    if (!(reached.entries[use.entry].validity > least)) continue;
    widen(reached.chunk.deviations.row(use.row).data(), size_ - 1, low_[node].data(), high_[node].data());
  }
}

std::vector<double>& Assembly::block_to_add_to(std::size_t leaf, std::size_t other) {
  std::vector<double>& block = sums_.blocks[leaf][other];
  block.resize(packed_, 0.0);
  return block;
}

// Adds the rows of a leaf to its sums and to its blocks with the leaves before it.
void Assembly::add(const ReachedRows& reached, std::size_t leaf) {
  const std::span<const ReachedRows::Use> uses = uses_of(reached, leaf);
  if (uses.empty()) return;
  const std::size_t node = sums_.leaves[leaf];
  thread_local std::vector<double> factors;  // these three are kept for their memory
  thread_local std::vector<double> scaled;
  thread_local std::vector<double> of_lot;
  factors.clear();
  Eigen::Index first = reached.column[leaf];
  for (const ReachedRows::Use& use : uses) {
    const double weight = reached.chunk.weights(use.row) * reached.entries[use.entry].validity;
    factors.push_back(weight);
    first = std::min(first, reached.column[reached.entries[use.before].leaf]);
    for (Eigen::Index o = 0; o < root_.cols(); ++o) {
      const double residual = reached.residuals(use.row, o);
      sums_.squares[node](o) += weight * residual * residual;
      sums_.products[node].col(o) += weight * residual * reached.regressors.row(use.row).transpose();
    }
  }
  scale_rows(uses, factors, reached, scaled, packed_gram_[leaf].data());
  const Eigen::Index numbers = padded_to_lanes(packed_);
  of_lot.resize(tile * numbers);
  for (Eigen::Index column = first; column <= reached.column[leaf]; column += tile) {
    sum_tile(uses, reached.validities, column, scaled, of_lot.data());
    for (Eigen::Index k = column; k < std::min(column + tile, reached.column[leaf] + 1); ++k) {
      const double* sum = of_lot.data() + (k - column) * numbers;
      // The sum of the products of validities: 0 where the leaves share no row.
      if (sum[0] > 0.0) add_numbers(sum, packed_, block_to_add_to(leaf, reached.leaves[k]).data());
    }
  }
}

void Assembly::add_with_missing(const ReachedRows& reached, std::size_t leaf) {
  const int node = sums_.leaves[leaf];
  for (const ReachedRows::Use& use : uses_of(reached, leaf)) {
    const Eigen::VectorXd x = regressors_at(by_, reached.chunk, use.row, node);
    const double weight = reached.chunk.weights(use.row) * reached.entries[use.entry].validity;
    for (Eigen::Index e = use.before; e <= use.entry; ++e) {
      const ReachedRows::Entry& entry = reached.entries[e];
      const Eigen::VectorXd of_other = regressors_at(by_, reached.chunk, use.row, sums_.leaves[entry.leaf]);
      Eigen::Map<RowMajor>(block_to_add_to(leaf, entry.leaf).data(), size_, size_) +=
          (weight * entry.validity * x) * of_other.transpose();
    }
    sums_.gram[node] += weight * x * x.transpose();
    sums_.products[node] += weight * x * reached.residuals.row(use.row);
    sums_.squares[node] += weight * reached.residuals.row(use.row).cwiseAbs2().transpose();
  }
}

// Sets the matrices of leaves from their lower triangles.
void Assembly::unpack_gram() {
  for (std::size_t leaf = 0; leaf < packed_gram_.size(); ++leaf) {
    Eigen::MatrixXd& gram = sums_.gram[sums_.leaves[leaf]];
    const double* value = packed_gram_[leaf].data();
    for (Eigen::Index i = 0; i < size_; ++i) {
      for (Eigen::Index j = 0; j <= i; ++j) gram(i, j) = gram(j, i) = *value++;
    }
  }
}

// Sums and ranges of inner nodes from those of their children; then all ranges are widened by the margin.
void Assembly::add_up_to_parents() {
  const std::vector<int> parents = parents_of(partition_);
  for (std::size_t i = partition_.nodes.size(); i-- > 0;) {
    Node& node = partition_.nodes[i];
    for (Eigen::Index k = 0; k < size_ - 1; ++k) {
      if (low_[i](k) <= high_[i](k)) {
        const double margin = range_margin * (high_[i](k) - low_[i](k));
        node.low(k) = std::clamp(low_[i](k) - margin, training_.spread(0, k), training_.spread(1, k));
        node.high(k) = std::clamp(high_[i](k) + margin, training_.spread(0, k), training_.spread(1, k));
      }
    }
    if (i > 0) {
      const std::size_t parent = parents[i];
      sums_.gram[parent] += sums_.gram[i];
      sums_.products[parent] += sums_.products[i];
      sums_.squares[parent] += sums_.squares[i];
      low_[parent] = low_[parent].cwiseMin(low_[i]);
      high_[parent] = high_[parent].cwiseMax(high_[i]);
    }
  }
}

}  // namespace

bool leaves_out_ambiguous(const TrainingRows& training, const Evaluator& evaluator) {
  double ambiguous = 0.0;
  double all = 0.0;
  for (Eigen::Index index = 0; training.has_missing && index < num_chunks(training); ++index) {
    const Chunk chunk = fetch(training, index, {});
    for (Eigen::Index r = 0; r < chunk.count(); ++r) {
      all += chunk.weights(r);
      ambiguous += evaluator.is_ambiguous(chunk.inputs.row(r).data()) ? chunk.weights(r) : 0.0;
    }
  }
  // If they are most of the data, they are better than nothing.
  return ambiguous > 0.0 && ambiguous <= 0.5 * all;
}

NormalEquations assemble(const TrainingRows& training, Partition& partition, const Eigen::MatrixXd& root,
                         int max_threads) {
  return Assembly(training, partition, root).run(max_threads);
}

}  // namespace llmt
