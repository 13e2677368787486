/// \file
/// How far rows lie from those that a local model was fitted to.
#pragma once

#include <vector>

#include "llmt/model.hpp"
#include "model/local_models.hpp"
#include "model/row_block.hpp"

namespace llmt {

/// Leverages a' (sum validity a a')^-1 a of the rows of `list` in `block`, where a = [1, deviations] with missing
/// deviations at the mean of the leaf's rows. Zeros if the leaf has no Node::inverse_gram.
void leverages(const Node& leaf, const RowList& list, const RowBlock& block, std::vector<double>& result);

}  // namespace llmt
