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

/// The number of levels of each input, 0 of a number.
std::vector<Eigen::Index> counts_of_levels(const std::vector<InputColumn>& inputs);

/// Throws std::invalid_argument if the models of the folds of an Intervals belong to another model: see to_json().
void check_belong(const std::vector<Model>& folds, const Model& model);

}  // namespace llmt
