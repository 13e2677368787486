/// \file
/// Runs over inputs that the record has in another order.
#pragma once

#include <vector>

#include "dynamics/model_structure.hpp"

namespace llmt {

/// Whether free runs over the record's inputs in other orders stay within the bounds of lower_bounds(). An order is
/// made of blocks of consecutive rows, for ten times as many rows as the record has, 20 000 at most. A block begins
/// where the inputs are near those at the end of the one before, so that no jump is made that the record does not have.
/// True where outputs add up: a run over other inputs may end anywhere.
///
/// The record shows a model only the states that its own inputs lead to, in their order, and held-out stretches are of
/// the same order.
bool stays_over_other_orders(const Task& task, const DynamicParts& parts, const std::vector<Stretch>& stretches);

}  // namespace llmt
