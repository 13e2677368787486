/// \file
/// Checks that models belong together.
#pragma once

#include <string>
#include <vector>

#include "llmt/model.hpp"

namespace llmt {

/// In words, the first difference between two models in the numbers of their inputs, outputs and levels; empty if there
/// is none.
std::string difference_of_columns(const Model& one, const Model& other);

/// Throws std::invalid_argument if the models of the folds of an Intervals belong to another model: see to_json().
void check_belong(const std::vector<Model>& folds, const Model& model);

}  // namespace llmt
