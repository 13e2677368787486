#include "estimation/sums/reached_rows.hpp"

#include <algorithm>

#include "base/simd.hpp"
#include "partition/imputed.hpp"

namespace llmt {
namespace {

// Sets regressors, residuals and products of a row.
void describe_row(const ReachedBy& by, Eigen::Index row, const std::vector<Activation>& active, ReachedRows& reached) {
  const Eigen::Index size = reached.regressors.cols();
  reached.regressors(row, 0) = 1.0;
  for (Eigen::Index k = 1; k < size; ++k) {
    reached.regressors(row, k) = reached.chunk.deviations(row, k - 1) / by.training.scale(k - 1);
  }
  if (by.training.has_missing) {
    for (const Activation& entry : active) {
      reached.residuals.row(row) -=
          entry.validity * regressors_at(by, reached.chunk, row, entry.node).transpose() * by.root;
    }
    return;
  }
  reached.residuals.row(row) -= reached.regressors.row(row) * by.root;
  Eigen::Index number = 0;
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j, ++number) {
      const Eigen::Index strip = number / lanes;
      reached.outer[(strip * reached.regressors.rows() + row) * lanes + number % lanes] =
          reached.regressors(row, i) * reached.regressors(row, j);
    }
  }
}

// Sets leaves, column and validities from uses.
void lay_out_validities(ReachedRows& reached) {
  const std::size_t leaves = reached.first_use.size() - 1;
  for (std::size_t leaf = 0; leaf < leaves; ++leaf) {
    reached.column.push_back(std::ssize(reached.leaves));
    if (reached.first_use[leaf] < reached.first_use[leaf + 1]) reached.leaves.push_back(static_cast<int>(leaf));
  }
  reached.validities.setZero(reached.chunk.count(), std::ssize(reached.leaves) + ReachedRows::more_columns);
  for (const ReachedRows::Use& use : reached.uses) {
    const ReachedRows::Entry& entry = reached.entries[use.entry];
    reached.validities(use.row, reached.column[entry.leaf]) = entry.validity;
  }
}

// Sets uses and first_use; `rows`: of every entry.
void sort_by_leaf(const std::vector<Eigen::Index>& rows, const std::vector<Eigen::Index>& before, std::size_t leaves,
                  ReachedRows& reached) {
  reached.first_use.assign(leaves + 1, 0);
  for (const ReachedRows::Entry& entry : reached.entries) {
    ++reached.first_use[entry.leaf + 1];
  }
  for (std::size_t leaf = 0; leaf < leaves; ++leaf) {
    reached.first_use[leaf + 1] += reached.first_use[leaf];
  }
  reached.uses.resize(reached.entries.size());
  std::vector<Eigen::Index> next = reached.first_use;
  for (std::size_t e = 0; e < rows.size(); ++e) {
    reached.uses[next[reached.entries[e].leaf]++] = {rows[e], before[rows[e]], static_cast<Eigen::Index>(e)};
  }
}

}  // namespace

ReachedRows reach(const ReachedBy& by, const std::vector<int>& positions) {
  const Eigen::Index rows = std::ssize(positions);
  const Eigen::Index size = by.root.rows();
  ReachedRows reached{.chunk = fetch(by.training, positions, by.partition.outputs),
                      .entries = {},
                      .uses = {},
                      .first_use = {},
                      .leaves = {},
                      .column = {},
                      .validities = {},
                      .regressors = RowMajor(rows, size),
                      .residuals = {},
                      .outer = {}};
  if (!by.training.has_missing) reached.outer.assign(padded_to_lanes(size * (size + 1) / 2) * rows, 0.0);
  reached.residuals = reached.chunk.outputs;
  std::vector<Activation> active;
  std::vector<Eigen::Index> row_of_entry;
  std::vector<Eigen::Index> before(rows, 0);
  for (Eigen::Index row = 0; row < rows; ++row) {
    const double* inputs = reached.chunk.inputs.row(row).data();
    before[row] = std::ssize(reached.entries);
    if (by.leaves_out_ambiguous && by.evaluator.is_ambiguous(inputs)) continue;
    by.evaluator.activate(inputs, active);
    if (by.evaluator.validities().are_gaussian()) {
      std::ranges::sort(active, {}, [&](const Activation& each) { return by.leaf_of_node[each.node]; });
    }
    for (const Activation& entry : active) {
      reached.entries.push_back({by.leaf_of_node[entry.node], entry.validity});
      row_of_entry.push_back(row);
    }
    describe_row(by, row, active, reached);
  }
  const auto leaves = std::ranges::count_if(by.leaf_of_node, [](int leaf) { return leaf >= 0; });
  sort_by_leaf(row_of_entry, before, leaves, reached);
  lay_out_validities(reached);
  return reached;
}

Eigen::VectorXd regressors_at(const ReachedBy& by, const Chunk& chunk, Eigen::Index row, int node) {
  const Eigen::Index size = by.root.rows();
  Eigen::VectorXd result(size);
  result(0) = 1.0;
  for (Eigen::Index k = 1; k < size; ++k) {
    result(k) = imputed(by.partition.nodes[node], k - 1, chunk.deviations(row, k - 1)) / by.training.scale(k - 1);
  }
  return result;
}

}  // namespace llmt
