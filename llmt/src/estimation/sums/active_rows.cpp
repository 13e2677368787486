#include "estimation/sums/active_rows.hpp"

#include <algorithm>

#include "base/simd.hpp"
#include "partition/imputed.hpp"

namespace llmt {
namespace {

// Sets regressors, residuals and products of a row.
void describe_row(const PartitionContext& by, Eigen::Index row, const std::vector<Activation>& active,
                  ActiveRows& result) {
  const Eigen::Index size = result.regressors.cols();
  result.regressors(row, 0) = 1.0;
  for (Eigen::Index k = 1; k < size; ++k) {
    result.regressors(row, k) = result.chunk.deviations(row, k - 1) / by.training.scale(k - 1);
  }
  if (by.training.has_missing) {
    for (const Activation& entry : active) {
      result.residuals.row(row) -=
          entry.validity * regressors_at(by, result.chunk, row, entry.node).transpose() * by.root;
    }
    return;
  }
  result.residuals.row(row) -= result.regressors.row(row) * by.root;
  Eigen::Index number = 0;
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j, ++number) {
      const Eigen::Index strip = number / lanes;
      result.outer[(strip * result.regressors.rows() + row) * lanes + number % lanes] =
          result.regressors(row, i) * result.regressors(row, j);
    }
  }
}

// Sets leaves, column and validities from uses.
void lay_out_validities(ActiveRows& result) {
  const std::size_t leaves = result.first_use.size() - 1;
  for (std::size_t leaf = 0; leaf < leaves; ++leaf) {
    result.column.push_back(std::ssize(result.leaves));
    if (result.first_use[leaf] < result.first_use[leaf + 1]) result.leaves.push_back(static_cast<int>(leaf));
  }
  result.validities.setZero(result.chunk.count(), std::ssize(result.leaves) + ActiveRows::more_columns);
  for (const ActiveRows::Use& use : result.uses) {
    const ActiveRows::Entry& entry = result.entries[use.entry];
    result.validities(use.row, result.column[entry.leaf]) = entry.validity;
  }
}

// Sets uses and first_use; `rows`: of every entry.
void sort_by_leaf(const std::vector<Eigen::Index>& rows, const std::vector<Eigen::Index>& before, std::size_t leaves,
                  ActiveRows& result) {
  result.first_use.assign(leaves + 1, 0);
  for (const ActiveRows::Entry& entry : result.entries) {
    ++result.first_use[entry.leaf + 1];
  }
  for (std::size_t leaf = 0; leaf < leaves; ++leaf) {
    result.first_use[leaf + 1] += result.first_use[leaf];
  }
  result.uses.resize(result.entries.size());
  std::vector<Eigen::Index> next = result.first_use;
  for (std::size_t e = 0; e < rows.size(); ++e) {
    result.uses[next[result.entries[e].leaf]++] = {rows[e], before[rows[e]], static_cast<Eigen::Index>(e)};
  }
}

}  // namespace

ActiveRows active_rows(const PartitionContext& by, const std::vector<int>& positions) {
  const Eigen::Index rows = std::ssize(positions);
  const Eigen::Index size = by.root.rows();
  ActiveRows result{.chunk = fetch(by.training, positions, by.partition.outputs),
                    .entries = {},
                    .uses = {},
                    .first_use = {},
                    .leaves = {},
                    .column = {},
                    .validities = {},
                    .regressors = RowMajor(rows, size),
                    .residuals = {},
                    .outer = {}};
  if (!by.training.has_missing) result.outer.assign(padded_to_lanes(size * (size + 1) / 2) * rows, 0.0);
  result.residuals = result.chunk.outputs;
  std::vector<Activation> active;
  std::vector<Eigen::Index> row_of_entry;
  std::vector<Eigen::Index> before(rows, 0);
  for (Eigen::Index row = 0; row < rows; ++row) {
    const double* inputs = result.chunk.inputs.row(row).data();
    before[row] = std::ssize(result.entries);
    if (by.leaves_out_ambiguous && by.evaluator.is_ambiguous(inputs)) continue;
    by.evaluator.activate(inputs, active);
    if (by.evaluator.validities().are_gaussian()) {
      std::ranges::sort(active, {}, [&](const Activation& each) { return by.leaf_of_node[each.node]; });
    }
    for (const Activation& entry : active) {
      result.entries.push_back({by.leaf_of_node[entry.node], entry.validity});
      row_of_entry.push_back(row);
    }
    describe_row(by, row, active, result);
  }
  const auto leaves = std::ranges::count_if(by.leaf_of_node, [](int leaf) { return leaf >= 0; });
  sort_by_leaf(row_of_entry, before, leaves, result);
  lay_out_validities(result);
  return result;
}

Eigen::VectorXd regressors_at(const PartitionContext& by, const Chunk& chunk, Eigen::Index row, int node) {
  const Eigen::Index size = by.root.rows();
  Eigen::VectorXd result(size);
  result(0) = 1.0;
  for (Eigen::Index k = 1; k < size; ++k) {
    result(k) = imputed(by.partition.nodes[node], k - 1, chunk.deviations(row, k - 1)) / by.training.scale(k - 1);
  }
  return result;
}

}  // namespace llmt
