/// \file
/// Categories that rows give by other values than the positions of levels: codes, and missing values that are a level
/// of their own, see InputColumn.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/model.hpp"

namespace llmt {

/// Stands for a category that is not among the levels, where NaN may be one of them.
inline constexpr double no_level = -1.0;

/// The position of the level for missing values in place of NaN, if there is one; and of the code nearest to `value`,
/// of two the smaller one. All other values stay.
double position_of(const InputColumn& input, double value);

bool has_codes(const std::vector<InputColumn>& columns);

/// Whether rows give an input by other values than those that the evaluation of a model takes.
bool needs_positions(const std::vector<InputColumn>& columns);

/// `inputs` (rows x columns) with positions in place of codes and of missing values that are a level, as the evaluation
/// of a model takes them.
Eigen::MatrixXd at_positions(const std::vector<InputColumn>& columns, const Eigen::Ref<const Eigen::MatrixXd>& inputs);

/// A model that was fitted to positions, as one of codes and missing values. `codes`: one list an input, ascending;
/// empty: the input has none. A level more than codes is that of missing values. So is the last level of an input that
/// has as many as `empty_levels` says, one an input. Both lists may be empty.
Model with_codes(const Model& model, const std::vector<std::vector<double>>& codes,
                 const std::vector<std::size_t>& empty_levels = {});

/// What the levels of an input with these codes are called.
std::vector<std::string> names_of_codes(const std::vector<double>& codes);

}  // namespace llmt
