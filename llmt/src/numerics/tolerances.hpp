/// \file
/// From which size on a direction of the regressors counts as present.
#pragma once

namespace llmt {

/// Pivots of an LDL' factorisation of a Gram matrix below this part of the column's sum of squares count as zero. The
/// rounding of the sums is about 1e-15 of them; what a narrow child legitimately leaves of a direction is larger.
inline constexpr double pivot_tolerance = 1e-12;

/// Directions below this part of the largest one, and columns of which those before leave less than this part, count as
/// none. Where it is applied to the columns themselves, columns that agree to ten digits are collinear; where it is
/// applied to a matrix of sums of squares, which has half the digits, those that agree to five.
inline constexpr double collinearity_tolerance = 1e-10;

}  // namespace llmt
