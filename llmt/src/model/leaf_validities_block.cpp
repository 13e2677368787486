// Many rows on their way down a tree at once: a node splits a list of rows in two.
#include <algorithm>

#include "model/leaf_validities.hpp"
#include "model/logistic.hpp"
#include "model/transition.hpp"

namespace llmt {
namespace {

// Rows of a node on their way to its children.
struct Fork {
  const int* rows;
  const double* validities;
  Eigen::Index count;
  int* left_rows;  // with space for `count` rows
  double* left_validities;
  int* right_rows;  // may be the same memory as `rows`
  double* right_validities;
};

struct Counts {
  Eigen::Index left = 0;
  Eigen::Index right = 0;
};

// A jump on a number that no row lacks.
Counts jump(const Fork& fork, const double* column, double threshold) {
  Counts counts;
  for (Eigen::Index i = 0; i < fork.count; ++i) {
    const int row = fork.rows[i];
    const double validity = fork.validities[i];
    // Both sides are written and one is kept, without a branch that the processor could predict wrongly.
    fork.left_rows[counts.left] = row;
    fork.left_validities[counts.left] = validity;
    fork.right_rows[counts.right] = row;
    fork.right_validities[counts.right] = validity;
    const bool goes_left = column[row] <= threshold;
    counts.left += goes_left ? 1 : 0;
    counts.right += goes_left ? 0 : 1;
  }
  return counts;
}

// `share(i)`: of the left child in the i-th row.
template <class Share>
LLMT_INLINE void hand_over(const Fork& fork, Eigen::Index begin, Eigen::Index end, const Share& share, Counts& counts) {
  for (Eigen::Index i = begin; i < end; ++i) {
    const double left = share(i);
    const int row = fork.rows[i];
    const double validity = fork.validities[i];
    fork.left_rows[counts.left] = row;
    fork.left_validities[counts.left] = validity * left;
    fork.right_rows[counts.right] = row;
    fork.right_validities[counts.right] = validity * (1.0 - left);
    counts.left += left > 0.0 ? 1 : 0;
    counts.right += left < 1.0 ? 1 : 0;
  }
}

// A transition on a number that no row lacks.
LLMT_FOR_EACH_INSTRUCTION_SET
Counts blend(const Fork& fork, const double* column, double threshold, double per_half_width, int smoothness) {
  constexpr Eigen::Index at_once = 64;
  double left[at_once] = {};
  Counts counts;
  for (Eigen::Index begin = 0; begin < fork.count; begin += at_once) {
    const Eigen::Index size = std::min(at_once, fork.count - begin);
    for (Eigen::Index i = 0; i < size; ++i) {
      left[i] = column[fork.rows[begin + i]];
    }
    for (Eigen::Index i = 0; i < size; ++i) {
      left[i] = transition((left[i] - threshold) * per_half_width, smoothness);
    }
    hand_over(
        fork, begin, begin + size, [&](Eigen::Index i) { return left[i - begin]; }, counts);
  }
  return counts;
}

// Logistic gates; `side`: of the i-th row.
LLMT_FOR_EACH_INSTRUCTION_SET
Counts gate(const Fork& fork, const double* side, double threshold, double per_half_width) {
  constexpr Eigen::Index at_once = 64;
  double left[at_once] = {};
  Counts counts;
  for (Eigen::Index begin = 0; begin < fork.count; begin += at_once) {
    const Eigen::Index size = std::min(at_once, fork.count - begin);
    for (Eigen::Index i = 0; i < size; ++i) {
      left[i] = logistic((side[begin + i] - threshold) * per_half_width);
    }
    hand_over(
        fork, begin, begin + size, [&](Eigen::Index i) { return left[i - begin]; }, counts);
  }
  return counts;
}

}  // namespace

void LeafValidities::for_each_leaf(const RowBlock& block,
                                   const std::function<void(int node, const RowList& list)>& visit) const {
  const std::size_t rows = block.rows();
  if (are_gaussian()) {
    std::vector<Waiting> of_node(branches_.size());
    std::vector<Activation> active;
    Eigen::VectorXd x(block.inputs.cols());
    for (std::size_t row = 0; row < rows; ++row) {
      x = block.inputs.row(row);
      activate_gaussians(x.data(), active);
      for (const Activation& entry : active) {
        of_node[entry.node].rows.push_back(static_cast<int>(row));
        of_node[entry.node].validities.push_back(entry.validity);
      }
    }
    for (std::size_t node = 0; node < of_node.size(); ++node) {
      if (const Waiting& list = of_node[node]; !list.rows.empty()) {
        visit(static_cast<int>(node), {list.rows.data(), list.validities.data(), std::ssize(list.rows)});
      }
    }
    return;
  }
  Waiting waiting{std::vector<int>(4 * rows), std::vector<double>(4 * rows)};
  for (std::size_t row = 0; row < rows; ++row) {
    waiting.rows[row] = static_cast<int>(row);
    waiting.validities[row] = 1.0;
  }
  struct Open {
    int node;
    Eigen::Index begin;
    Eigen::Index count;
  };
  std::vector<Open> open = {{0, 0, block.rows()}};  // right children that wait, the leftmost last
  while (!open.empty()) {
    auto [node, begin, count] = open.back();
    open.pop_back();
    while (count > 0 && left(node) >= 0) {
      const ForkCounts counts = fork(node, begin, count, block, waiting);
      open.push_back({right(node), begin, counts.right});
      node = left(node);
      begin += count;
      count = counts.left;
    }
    if (count > 0) visit(node, {waiting.rows.data() + begin, waiting.validities.data() + begin, count});
  }
}

LeafValidities::ForkCounts LeafValidities::fork(int node, Eigen::Index begin, Eigen::Index count, const RowBlock& block,
                                                Waiting& waiting) const {
  const Branch& branch = branches_[node];
  const std::size_t needed = begin + 2 * count;
  if (waiting.rows.size() < needed) {
    waiting.rows.resize(2 * needed);
    waiting.validities.resize(2 * needed);
  }
  int* rows = waiting.rows.data() + begin;
  double* validities = waiting.validities.data() + begin;
  const Fork parts{rows, validities, count, rows + count, validities + count, rows, validities};
  const double* column = block.inputs.col(branch.input).data();
  Counts counts;
  if (branch.first_term >= 0) {
    const double* first = block.inputs.data();
    const Eigen::Index stride = block.inputs.outerStride();
    std::vector<double> sides(count);
    for (Eigen::Index i = 0; i < count; ++i) {
      sides[i] = oblique_side(branch, first + rows[i], stride);
    }
    if (kind_ == ValidityKind::logistic && branch.per_half_width != 0.0) {
      counts = gate(parts, sides.data(), branch.threshold, branch.per_half_width);
    } else {
      hand_over(
          parts, 0, count, [&](Eigen::Index i) { return left_share(branch, sides[i]); }, counts);
    }
  } else if (branch.first_level >= 0 || block.has_missing[branch.input] ||
             (kind_ == ValidityKind::logistic && branch.per_half_width != 0.0)) {
    hand_over(
        parts, 0, count, [&](Eigen::Index i) { return left_share(branch, column[rows[i]]); }, counts);
  } else if (branch.per_half_width == 0.0) {
    counts = jump(parts, column, branch.threshold);
  } else {
    counts = blend(parts, column, branch.threshold, branch.per_half_width, smoothness_);
  }
  return {counts.left, counts.right};
}

}  // namespace llmt
