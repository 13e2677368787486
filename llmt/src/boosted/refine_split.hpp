/// \file
/// A split that was found between bins is moved to the best of the cells next to it.
#pragma once

#include <span>
#include <vector>

#include "boosted/growing_tree.hpp"

namespace llmt {

/// The cells of the bins on both sides of a split.
struct Window {
  int first = 0;
  int last = 0;

  bool has(int cell) const { return static_cast<unsigned>(cell - first) <= static_cast<unsigned>(last - first); }
};
Window window_of(const BinnedFeature& feature, const SplitChoice& choice);

/// A row whose cell is in the window.
struct RowOfWindow {
  int cell = 0;
  int leaf = 0;
  double weight = 0.0;
  double residual = 0.0;
  double z = 0.0;
};

/// The sums over a leaf's rows, and over those that are below the window.
struct SumsOfLeaf {
  SideSums all;
  SideSums left;
  bool slope = false;
};

/// The choice with the best of the window's cells. The order of rows of one cell in `window` is kept.
SplitChoice best_of_window(std::vector<RowOfWindow> window, std::vector<SumsOfLeaf> leaves, const Ridges& ridges,
                           SplitChoice choice);

}  // namespace llmt
