/// \file
/// The steps of backward elimination.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

namespace llmt {

/// The number of inputs after `count` of them, eq. (K.1) of docs/algorithms/input-choice.md; 0 after 1.
inline Eigen::Index fewer_inputs(Eigen::Index count) {
  constexpr double kept_part = 0.7;
  return std::min(count - 1, static_cast<Eigen::Index>(std::ceil(kept_part * static_cast<double>(count))));
}

/// The `count` inputs of largest importance, ascending. `inputs`: ascending; of equal importance the first columns.
/// `importance`: one entry a column of the table.
inline std::vector<int> most_important(std::vector<int> inputs, const Eigen::VectorXd& importance, Eigen::Index count) {
  std::ranges::stable_sort(inputs, [&](int a, int b) { return importance(a) > importance(b); });
  inputs.resize(count);
  std::ranges::sort(inputs);
  return inputs;
}

}  // namespace llmt
