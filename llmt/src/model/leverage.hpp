/// \file
/// How far rows lie from those that a local model was fitted to.
#pragma once

#include <vector>

#include "llmt/model.hpp"
#include "model/local_models.hpp"
#include "model/row_block.hpp"

namespace llmt {

/// a' (sum validity a a')^-1 a, a = [1, deviations], missing ones as in the mean of the leaf's rows, of each row of
/// `list` in `block`; zeros if the leaf has no Node::inverse_gram.
void leverages(const Node& leaf, const RowList& list, const RowBlock& block, std::vector<double>& result);

}  // namespace llmt
