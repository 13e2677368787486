/// \file
/// Inputs whose numbers are codes: categories given as numbers, see InputColumn::codes.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/model.hpp"

namespace llmt {

/// The position of the code nearest to `value`, of two the smaller one. NaN and infinity stay, and so do all values of
/// an input without codes.
double position_of(const InputColumn& input, double value);

bool has_codes(const std::vector<InputColumn>& columns);

/// `inputs` (rows x columns) with positions in place of codes, as the evaluation of a model takes them.
Eigen::MatrixXd at_positions(const std::vector<InputColumn>& columns, const Eigen::Ref<const Eigen::MatrixXd>& inputs);

/// A model that was fitted to positions, as one of the codes. `codes`: one list an input, ascending; empty: the input
/// stays as it is.
Model with_codes(const Model& model, const std::vector<std::vector<double>>& codes);

/// What the levels of an input with these codes are called.
std::vector<std::string> names_of_codes(const std::vector<double>& codes);

}  // namespace llmt
