/// \file
/// Quadrature that integrates the games of a tree exactly.
#pragma once

#include <vector>

#include "llmt/boosted_sum.hpp"

namespace llmt {

/// The order of a quadrature that integrates the games of a tree exactly: half the number of different inputs on the
/// way to a leaf and in it, where these are most, rounded up to an even number.
int order_for(const BoostedTree& tree, const std::vector<BoostedFeature>& features);

/// Gauss-Legendre quadrature of an even order over the probability p that an input is taken from the row.
struct GameRule {
  explicit GameRule(int order);

  std::vector<double> row;         ///< p at the nodes
  std::vector<double> background;  ///< 1 - p
  std::vector<double> weights;
  std::vector<double> per_row;         ///< weights / p
  std::vector<double> per_background;  ///< weights / (p - 1)
};

}  // namespace llmt
