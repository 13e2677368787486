/// \file
/// What the weight of a row may be, wherever rows have weights.
#pragma once

#include "llmt/options.hpp"

namespace llmt {

/// Sums of weights and of their products with squares of standardised values stay finite.
inline bool is_row_weight(double weight) { return weight >= 0.0 && weight <= largest_magnitude; }

inline constexpr const char* words_of_row_weight = "from 0 to 1e150";

}  // namespace llmt
