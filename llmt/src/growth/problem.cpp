#include "growth/problem.hpp"

#include <algorithm>
#include <cmath>

namespace llmt {

// Every level of the tree takes about as long: all rows are searched once on each.
void GrowthProblem::searched(Eigen::Index rows) const {
  if (work == nullptr) return;
  const auto all = static_cast<double>(training->count());
  double leaves = std::max(1.0, all / static_cast<double>(std::max<Eigen::Index>(1, options.min_leaf_samples)));
  if (options.max_leaves > 0) leaves = std::min(leaves, static_cast<double>(options.max_leaves));
  work->did(static_cast<double>(rows) / (all * (1.0 + std::log2(leaves))));
}

void GrowthProblem::check(Eigen::Index rows) const {
  constexpr Eigen::Index large_node = 10000;
  if (work != nullptr && rows >= large_node) work->check();
}

}  // namespace llmt
