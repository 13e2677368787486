/// \file
/// Which directions of a local model some rows decide.
#pragma once

#include <span>

#include "numerics/gram.hpp"

namespace llmt {

/// Rank of constant and regressors in the rows of a Gram matrix without some of them.
int rank_without(const Features& features, const double* gram, std::span<const int> rows, ResidualSums& sums);

}  // namespace llmt
