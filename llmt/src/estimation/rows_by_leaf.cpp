#include "estimation/rows_by_leaf.hpp"

#include <algorithm>
#include <numeric>
#include <span>

namespace llmt {
namespace {

// Of every leaf, its place from left to right in the tree.
std::vector<int> places_of(const Partition& partition) {
  std::vector<int> place(partition.nodes.size(), 0);
  std::vector<int> stack = {0};
  for (int next = 0; !stack.empty();) {
    const int node = stack.back();
    stack.pop_back();
    if (partition.nodes[node].is_leaf()) {
      place[node] = next++;
    } else {
      stack.push_back(partition.nodes[node].right);
      stack.push_back(partition.nodes[node].left);
    }
  }
  return place;
}

}  // namespace

std::vector<int> rows_by_leaf(const TrainingRows& rows, const Partition& partition, const Evaluator& evaluator) {
  const std::vector<int> place = places_of(partition);
  std::vector<int> place_of_row(rows.count());
  std::vector<int> order(rows.count());
  std::iota(order.begin(), order.end(), 0);
  for (Eigen::Index begin = 0; begin < rows.count(); begin += chunk_rows) {
    const std::size_t count = std::min(chunk_rows, rows.count() - begin);
    const RowMajor inputs = inputs_of(rows, std::span(order).subspan(begin, count));
    for (Eigen::Index row = 0; row < inputs.rows(); ++row) {
      int node = 0;
      while (!partition.nodes[node].is_leaf()) node = evaluator.child_of(node, inputs.row(row).data());
      place_of_row[begin + row] = place[node];
    }
  }
  std::ranges::stable_sort(order, {}, [&](int row) { return place_of_row[row]; });
  return order;
}

}  // namespace llmt
