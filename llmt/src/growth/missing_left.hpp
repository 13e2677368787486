/// \file
/// Validity of the left child for rows that have no value of the split input (docs/algorithms/data.md, D.2).
#pragma once

#include <algorithm>

namespace llmt {

/// Weighted sums over a node's rows without a value, added over the outputs, each output divided by its sum of squares.
/// D_n and r_n are those of equation D.2.
struct MissingSums {
  double squares = 0.0;   ///< sum of q_n D_n^2
  double products = 0.0;  ///< sum of q_n D_n r_n
  double rows = 0.0;      ///< their number
};

/// Node::missing_left by equation D.2, in [0, 1]. `known`: the left child's part of the weight of the rows with a
/// value; the result if there are no rows without a value or the children predict the same for all of them.
inline double learned_missing_left(const MissingSums& sums, double known) {
  constexpr double rows_of_known = 20.0;  // what `known` counts against the rows without a value
  if (!(sums.squares > 0.0)) return known;
  const double prior = rows_of_known * sums.squares / sums.rows;
  return std::clamp((sums.products + prior * known) / (sums.squares + prior), 0.0, 1.0);
}

}  // namespace llmt
