/// \file
/// Whether models belong together.
#pragma once

#include <string>

#include "llmt/intervals.hpp"

namespace llmt {

/// In words, the first difference between two models in the numbers of their inputs, outputs and levels; empty if there
/// is none.
std::string difference_of_columns(const Model& one, const Model& other);

/// Throws std::invalid_argument if the intervals belong to another model: see save().
void check_belong(const Intervals& intervals, const Model& model);

}  // namespace llmt
