#include "estimation/sums/rows_by_leaf.hpp"

#include <algorithm>
#include <numeric>
#include <span>

#include "base/parallel.hpp"

namespace llmt {
namespace {

// The place of every leaf, from left to right in the tree.
std::vector<int> places_of(const Partition& partition) {
  std::vector<int> place(partition.nodes.size(), 0);
  int next = 0;
  for (const int leaf : leaves_from_left(partition)) {
    place[leaf] = next++;
  }
  return place;
}

}  // namespace

std::vector<int> leaves_from_left(const Partition& partition) {
  std::vector<int> leaves;
  std::vector<int> stack = {0};
  while (!stack.empty()) {
    const int node = stack.back();
    stack.pop_back();
    if (partition.nodes[node].is_leaf()) {
      leaves.push_back(node);
    } else {
      stack.push_back(partition.nodes[node].right);
      stack.push_back(partition.nodes[node].left);
    }
  }
  return leaves;
}

std::vector<int> rows_by_leaf(const TrainingRows& rows, const Partition& partition, const Evaluator& evaluator,
                              int max_threads) {
  const std::vector<int> place = places_of(partition);
  std::vector<int> place_of_row(rows.count());
  std::vector<int> order(rows.count());
  std::iota(order.begin(), order.end(), 0);
  parallel_for(num_chunks(rows), max_threads, [&](Eigen::Index index) {
    const RowSpan block = RowBlocks{rows.count()}[index];
    const RowMajor inputs = inputs_of(rows, std::span(order).subspan(block.begin, block.count()));
    for (Eigen::Index row = 0; row < inputs.rows(); ++row) {
      int node = 0;
      while (!partition.nodes[node].is_leaf()) node = evaluator.child_of(node, inputs.row(row).data());
      place_of_row[block.begin + row] = place[node];
    }
  });
  std::ranges::stable_sort(order, {}, [&](int row) { return place_of_row[row]; });
  return order;
}

}  // namespace llmt
