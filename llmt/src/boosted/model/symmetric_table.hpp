/// \file
/// A crisp symmetric tree as a table of its leaves, for predictions of many rows.
#pragma once

#include <optional>
#include <vector>

#include "llmt/boosted_sum.hpp"

namespace llmt {

/// Rows that are predicted at once.
inline constexpr int rows_at_once = 64;

/// All splits of a level are one, and all leaves have slopes in the same features.
struct SymmetricTable {
  struct Level {
    int feature = 0;
    double threshold = 0.0;
    bool missing_left = false;
  };
  struct Leaf {
    double constant = 0.0;
    double low = 0.0;
    double high = 0.0;
  };
  std::vector<Level> levels;
  std::vector<int> features;
  std::vector<int> needed;     ///< features without which a row goes to both sides, or counts in a leaf as its mean
  std::vector<Leaf> leaves;    ///< the number of a row's leaf has a bit for each level, 1: right
  std::vector<double> slopes;  ///< of each leaf
};

/// The table of a tree, or none if it has another form.
std::optional<SymmetricTable> symmetric_table(const BoostedTree& tree);

/// values += the tree's values, the same bytes as value_of(). `z`: of each feature rows_at_once values; `in_slopes`:
/// the same with 0 for a missing one.
void add_values(const SymmetricTable& table, const double* z, const double* in_slopes, double* values);

}  // namespace llmt
