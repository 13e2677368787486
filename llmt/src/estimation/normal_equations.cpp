#include "estimation/normal_equations.hpp"

#include <algorithm>
#include <limits>

#include "base/count.hpp"
#include "base/parallel.hpp"
#include "estimation/missing_by_validity.hpp"
#include "estimation/rows_by_leaf.hpp"
#include "model/evaluator.hpp"
#include "model/imputed.hpp"
#include "numerics/dense.hpp"

namespace llmt {
namespace {

// The range in which a leaf's slopes count reaches beyond its outermost rows by this part of the range of its rows.
// Thresholds lie between rows, so queries of the leaf may be half a step outside of its rows.
constexpr double range_margin = 0.25;

// Logistic gates give every leaf some validity at every row. Only rows with more than this count in a leaf's range.
constexpr double reach_of_logistic = 1e-3;

// Rows of one step.
constexpr Eigen::Index rows_at_once = 256;

// Most numbers that the outer products of the rows of one step take: 64 MiB.
constexpr Eigen::Index outer_products = Eigen::Index{1} << 23;

inline void add_scaled(double* a, const double* b, double factor, Eigen::Index size) {
  for (Eigen::Index k = 0; k < size; ++k) {
    a[k] += factor * b[k];
  }
}
constexpr double infinity = std::numeric_limits<double>::infinity();

// A leaf that reaches a row.
struct Entry {
  int leaf;
  double validity;
};

// A row that a leaf reaches.
struct Use {
  Eigen::Index row;     // in the chunk
  Eigen::Index before;  // position of the row's first entry
  Eigen::Index entry;   // position of the leaf's entry for this row
};

// A chunk of rows with the leaves that reach them.
struct Reached {
  Chunk chunk;
  std::vector<Entry> entries;          // row after row; within a row by ascending leaf
  std::vector<std::vector<Use>> uses;  // of every leaf
  RowMajor regressors;                 // scaled, with the constant; NaN: missing
  RowMajor residuals;
  RowMajor outer;  // lower triangles of a a', without missing values
};

// One pass over the rows that forms the sums.
class Assembly {
 public:
  Assembly(const TrainingRows& training, Partition& partition, const Eigen::MatrixXd& root);

  NormalEquations run(int max_threads);

 private:
  Reached reach(std::vector<int> positions) const;
  void describe_row(Reached& reached, Eigen::Index row, const std::vector<Activation>& active) const;
  Eigen::VectorXd regressors_at(const Reached& reached, Eigen::Index row, int node) const;
  void widen_range(const Reached& reached, std::size_t leaf);
  std::vector<double>& block_to_add_to(std::size_t leaf, std::size_t other);
  void add(const Reached& reached, std::size_t leaf);
  void add_with_missing(const Reached& reached, std::size_t leaf);
  void add_up_to_parents();

  const TrainingRows& training_;
  Partition& partition_;
  const Eigen::MatrixXd& root_;
  const Eigen::Index size_;    // coefficients of a local model
  const Eigen::Index packed_;  // numbers that a block is stored in
  const Evaluator evaluator_;
  const bool leave_out_;
  std::vector<int> leaf_of_node_;
  NormalEquations sums_;
  std::vector<Eigen::VectorXd> low_;  // of every node
  std::vector<Eigen::VectorXd> high_;
};

Assembly::Assembly(const TrainingRows& training, Partition& partition, const Eigen::MatrixXd& root)
    : training_(training),
      partition_(partition),
      root_(root),
      size_(std::ssize(training.regressors) + 1),
      packed_(training.has_missing ? size_ * size_ : size_ * (size_ + 1) / 2),
      evaluator_(partition, training.columns, std::ssize(training.regressors)),
      leave_out_(leaves_out_ambiguous(training, evaluator_)),
      leaf_of_node_(partition.nodes.size(), -1) {
  const int nodes = count_of(partition.nodes);
  sums_.size = size_;
  sums_.missing = training.has_missing;
  for (int i = 0; i < nodes; ++i) {
    if (partition.nodes[i].is_leaf()) {
      leaf_of_node_[i] = count_of(sums_.leaves);
      sums_.leaves.push_back(i);
      sums_.blocks.emplace_back(sums_.leaves.size());
    }
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
  if (overlap && sums_.missing) describe_missing_by_validity(training_, evaluator_, leave_out_, partition_);
  const Eigen::Index at_once = std::clamp<Eigen::Index>(outer_products / packed_, 1, rows_at_once);
  const std::vector<int> rows = rows_by_leaf(training_, partition_, evaluator_);
  for (auto begin = rows.begin(); begin != rows.end();) {
    const auto end = begin + std::min<std::ptrdiff_t>(at_once, rows.end() - begin);
    const Reached reached = reach({begin, end});
    begin = end;
    // Leaves are independent: each adds to its own sums and to its blocks with the leaves before it.
    parallel_for(std::ssize(sums_.leaves), max_threads, [&](Eigen::Index position) {
      const std::size_t leaf = position;
      if (!reached.uses[leaf].empty()) {
        widen_range(reached, leaf);
        if (sums_.missing) {
          add_with_missing(reached, leaf);
        } else {
          add(reached, leaf);
        }
      }
    });
  }
  add_up_to_parents();
  if (overlap && !sums_.missing) describe_missing_by_sums(sums_, training_.scale, partition_);
  return std::move(sums_);
}

Reached Assembly::reach(std::vector<int> positions) const {
  const Eigen::Index rows = std::ssize(positions);
  Reached reached{.chunk = fetch(training_, positions, partition_.outputs),
                  .entries = {},
                  .uses = std::vector<std::vector<Use>>(sums_.leaves.size()),
                  .regressors = {},
                  .residuals = {},
                  .outer = {}};
  reached.regressors = RowMajor::Zero(rows, size_);
  reached.residuals = RowMajor::Zero(rows, root_.cols());
  reached.outer.resize(sums_.missing ? 0 : rows, packed_);
  std::vector<Activation> active;
  for (Eigen::Index row = 0; row < rows; ++row) {
    const double* inputs = reached.chunk.inputs.row(row).data();
    if (leave_out_ && evaluator_.is_ambiguous(inputs)) continue;
    evaluator_.activate(inputs, active);
    std::ranges::sort(active, [](const auto& a, const auto& b) { return a.node < b.node; });
    const Eigen::Index before = std::ssize(reached.entries);
    for (const Activation& entry : active) {
      const int leaf = leaf_of_node_[entry.node];
      reached.uses[leaf].push_back({row, before, std::ssize(reached.entries)});
      reached.entries.push_back({leaf, entry.validity});
    }
    describe_row(reached, row, active);
  }
  return reached;
}

// Sets regressors, residuals and products of a row.
void Assembly::describe_row(Reached& reached, Eigen::Index row, const std::vector<Activation>& active) const {
  reached.regressors(row, 0) = 1.0;
  for (Eigen::Index k = 1; k < size_; ++k) {
    reached.regressors(row, k) = reached.chunk.deviations(row, k - 1) / training_.scale(k - 1);
  }
  reached.residuals.row(row) = reached.chunk.outputs.row(row);
  if (sums_.missing) {
    for (const Activation& entry : active) {
      reached.residuals.row(row) -= entry.validity * regressors_at(reached, row, entry.node).transpose() * root_;
    }
    return;
  }
  reached.residuals.row(row) -= reached.regressors.row(row) * root_;
  double* out = reached.outer.row(row).data();
  for (Eigen::Index i = 0; i < size_; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      *out++ = reached.regressors(row, i) * reached.regressors(row, j);
    }
  }
}

// The regressors as a node sees them, which replaces missing ones by its means.
Eigen::VectorXd Assembly::regressors_at(const Reached& reached, Eigen::Index row, int node) const {
  Eigen::VectorXd result(size_);
  result(0) = 1.0;
  for (Eigen::Index k = 1; k < size_; ++k) {
    result(k) = imputed(partition_.nodes[node], k - 1, reached.chunk.deviations(row, k - 1)) / training_.scale(k - 1);
  }
  return result;
}

void Assembly::widen_range(const Reached& reached, std::size_t leaf) {
  const std::size_t node = sums_.leaves[leaf];
  const double least = partition_.validity.kind == ValidityKind::logistic ? reach_of_logistic : 0.0;
  for (const Use& use : reached.uses[leaf]) {
    if (!(reached.entries[use.entry].validity > least)) continue;
    const double* deviations = reached.chunk.deviations.row(use.row).data();
    for (Eigen::Index k = 0; k < size_ - 1; ++k) {
      low_[node](k) = deviations[k] < low_[node](k) ? deviations[k] : low_[node](k);
      high_[node](k) = deviations[k] > high_[node](k) ? deviations[k] : high_[node](k);
    }
  }
}

std::vector<double>& Assembly::block_to_add_to(std::size_t leaf, std::size_t other) {
  std::vector<double>& block = sums_.blocks[leaf][other];
  block.resize(packed_, 0.0);
  return block;
}

// Adds to all blocks of a leaf by one matrix product: validities of the leaves before it times weighted outer products.
void Assembly::add(const Reached& reached, std::size_t leaf) {
  const std::vector<Use>& uses = reached.uses[leaf];
  const std::size_t node = sums_.leaves[leaf];
  std::vector<int> column_of(leaf + 1, -1);
  std::vector<int> others;
  for (const Use& use : uses) {
    for (Eigen::Index e = use.before; e <= use.entry; ++e) {
      const int other = reached.entries[e].leaf;
      if (column_of[other] < 0) {
        column_of[other] = count_of(others);
        others.push_back(other);
      }
    }
  }
  const Eigen::Index columns = std::ssize(others) + 1;  // last: 1, for G
  RowMajor validities = RowMajor::Zero(std::ssize(uses), columns);
  RowMajor products(std::ssize(uses), packed_);
  for (Eigen::Index row = 0; row < std::ssize(uses); ++row) {
    const Use& use = uses[row];
    const double weight = reached.chunk.weights(use.row) * reached.entries[use.entry].validity;
    const double* outer = reached.outer.row(use.row).data();
    double* product = products.row(row).data();
    for (Eigen::Index k = 0; k < packed_; ++k) {
      product[k] = weight * outer[k];
    }
    for (Eigen::Index e = use.before; e <= use.entry; ++e) {
      const Entry& entry = reached.entries[e];
      validities(row, column_of[entry.leaf]) = entry.validity;
    }
    validities(row, columns - 1) = 1.0;
    for (Eigen::Index o = 0; o < root_.cols(); ++o) {
      sums_.squares[node](o) += weight * reached.residuals(use.row, o) * reached.residuals(use.row, o);
      add_scaled(sums_.products[node].col(o).data(), reached.regressors.row(use.row).data(),
                 weight * reached.residuals(use.row, o), size_);
    }
  }
  RowMajor sums = RowMajor::Zero(columns, packed_);
  add_transposed_product(columns, packed_, validities.rows(), 1.0, validities.data(), columns, products.data(), packed_,
                         sums.data(), packed_);
  for (std::size_t k = 0; k < others.size(); ++k) {
    std::vector<double>& block = block_to_add_to(leaf, others[k]);
    Eigen::Map<Eigen::VectorXd>(block.data(), packed_) += sums.row(k).transpose();
  }
  const double* sum = sums.row(columns - 1).data();
  for (Eigen::Index i = 0; i < size_; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j, ++sum) {
      sums_.gram[node](i, j) += *sum;
      sums_.gram[node](j, i) += i == j ? 0.0 : *sum;
    }
  }
}

void Assembly::add_with_missing(const Reached& reached, std::size_t leaf) {
  const int node = sums_.leaves[leaf];
  for (const Use& use : reached.uses[leaf]) {
    const Eigen::VectorXd x = regressors_at(reached, use.row, node);
    const double weight = reached.chunk.weights(use.row) * reached.entries[use.entry].validity;
    for (Eigen::Index e = use.before; e <= use.entry; ++e) {
      const Entry& entry = reached.entries[e];
      const std::size_t other = entry.leaf;
      const Eigen::VectorXd of_other = regressors_at(reached, use.row, sums_.leaves[other]);
      std::vector<double>& block = block_to_add_to(leaf, other);
      for (Eigen::Index i = 0; i < size_; ++i) {
        add_scaled(block.data() + i * size_, of_other.data(), weight * entry.validity * x(i), size_);
      }
    }
    sums_.gram[node] += weight * x * x.transpose();
    sums_.products[node] += weight * x * reached.residuals.row(use.row);
    sums_.squares[node] += weight * reached.residuals.row(use.row).cwiseAbs2().transpose();
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
