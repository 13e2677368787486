/// \file
/// Inputs cut into bins, once for a whole tree.
#pragma once

#include <cstdint>
#include <vector>

#include "growth/growth_data.hpp"

namespace llmt {

/// How a split input is cut.
struct Bins {
  std::vector<double> edges;     ///< of a number: bin b holds edges[b - 1] < x <= edges[b]; empty for categories
  int count = 1;                 ///< number of bins, or levels
  std::vector<bool> splittable;  ///< whether a bin of a number holds different values
};

/// All split inputs as small numbers.
struct BinnedInputs {
  std::vector<Bins> bins;           ///< of each split input
  std::vector<std::uint8_t> codes;  ///< bin, or level: training rows x split inputs, one row after the other

  int code(int row, std::size_t input) const { return codes[row * bins.size() + input]; }
};

inline constexpr int most_bins = 256;

/// Bins of all split inputs: levels of categories; of numbers at most `bins` with about as many rows each, between
/// quantiles of a sample that does not depend on the order of the rows. No value may be missing, no input may have more
/// than `most_bins` levels.
BinnedInputs make_bins(const GrowthData& data, int bins);

}  // namespace llmt
