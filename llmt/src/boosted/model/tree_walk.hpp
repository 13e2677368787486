/// \file
/// A soft tree of a sum as the steps of a walk through it, for predictions of many rows.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "boosted/model/symmetric_table.hpp"
#include "llmt/boosted_sum.hpp"

namespace llmt {

/// Depth first, the left side before the right one: a split, what is on its left side, a turn to its right side, and
/// what is there.
struct TreeWalk {
  enum class Kind { split, leaf, to_right };
  struct Step {
    Kind kind;
    int level = 0;   ///< splits above
    int number = 0;  ///< of the split's place, or of the leaf
  };
  /// What splits may share.
  struct Place {
    int feature;
    double threshold;
    double half_width;

    bool operator==(const Place&) const = default;
  };
  struct Leaf {
    double constant;
    double low;
    double high;
    std::size_t first;  ///< of its slopes
    std::size_t count;
  };
  struct Slope {
    int feature;
    double slope;
  };
  std::vector<Step> steps;
  std::vector<Place> places;
  std::vector<Leaf> leaves;
  std::vector<Slope> slopes;
  std::vector<int> needed;  ///< features of splits, and those that count in a leaf as their mean where a row lacks them
  double smallest_share = 0.0;
};

/// The walk of a tree: every row meets every leaf. None if no split is soft, as then each row meets one leaf, or if it
/// has more than 16 levels or 64 places.
std::optional<TreeWalk> walk_of(const BoostedTree& tree);

/// values += the tree's values, the same bytes as value_of() for rows that have the features needed. `z` and
/// `in_slopes` as of a SymmetricTable.
void add_values(const TreeWalk& walk, const double* z, const double* in_slopes, double* values);

}  // namespace llmt
