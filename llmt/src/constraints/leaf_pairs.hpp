/// \file
/// The conditions (O.1) of docs/algorithms/constraints.md between leaves on either side of splits on monotone inputs.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "constraints/leaf_geometry.hpp"
#include "data/dataset.hpp"

namespace llmt {

/// For every pair of leaves l, r that an ordered split with threshold t and half width h divides, the condition that
///   sign x (f_r - f_l + of_left f_l' + of_right f_r') >= 0  at x_j = t
/// for all values of the other inputs and all coefficients of_left, of_right. f are the guarded local models, f' their
/// slopes in x_j. This is h / |g'| times (O.1), in Bernstein form.
///
/// f_r - f_l is a sum of functions of one input each. The possible values of each function are the options of an input:
/// its smallest value is the smallest option. Everything is linear in the coefficients of the leaves.
struct LeafPairs {
  /// A contiguous range of elements.
  struct Range {
    Eigen::Index first = 0;
    Eigen::Index count = 0;
  };
  /// Part of an option: slope of the right leaf x right - slope of the left leaf x left.
  struct Term {
    Eigen::Index regressor;
    double left;
    double right;
  };
  /// A value that an input's part of f_r - f_l may have, or a lower bound of it: constant + sum of terms.
  struct Option {
    double constant;
    Range terms;
  };
  struct Coefficient {
    double of_left;
    double of_right;
  };
  struct Pair {
    int split;  ///< nodes
    int left;
    int right;
    double sign;
    Eigen::Index regressor;  ///< of the split input; -1: none
    Range inputs;            ///< of `inputs`
    Range coefficients;
  };

  std::vector<Pair> pairs;    ///< those of one split one after the other, lowest splits first
  std::vector<Range> inputs;  ///< the options of one input of one pair
  std::vector<Option> options;
  std::vector<Term> terms;
  std::vector<Coefficient> coefficients;
};

/// `below`: the leaves below each node.
LeafPairs leaf_pairs(const LeafGeometry& geometry, const Partition& partition,
                     const std::vector<std::vector<int>>& below);

}  // namespace llmt
