/// \file
/// Inputs cut into bins, once for a whole tree.
#pragma once

#include <cstdint>
#include <vector>

#include "growth_data.hpp"

namespace llmt {

/// A split input as small numbers.
struct Bins {
  std::vector<double> edges;        ///< of a number: bin b holds edges[b - 1] < x <= edges[b]; empty for categories
  std::vector<std::uint8_t> codes;  ///< bin, or level, of each training row
  int count = 1;                    ///< number of bins, or levels
  std::vector<bool> splittable;     ///< whether a bin of a number holds different values
};

inline constexpr int most_bins = 256;

/// Bins of all split inputs: levels of categories; of numbers at most `bins` with about as many rows each, between
/// quantiles of a sample that does not depend on the order of the rows. No value may be missing, no input may have more
/// than `most_bins` levels.
std::vector<Bins> make_bins(const GrowthData& data, int bins);

}  // namespace llmt
