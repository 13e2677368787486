/// \file
/// What a caller of fit() may have got wrong: std::invalid_argument naming argument, value and bound.
#pragma once

#include <vector>

#include "data/dataset.hpp"
#include "llmt/options.hpp"

namespace llmt {

/// Inputs and outputs may not be larger: squares stay finite; with quadratic local models squares of products too.
inline constexpr double largest_magnitude = 1e150;
inline constexpr double largest_factor = 1e70;

void check_options(const FitOptions& options, Eigen::Index inputs);

/// The caller's data, checked; no columns named means all of them.
Table make_table(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
                 const FitOptions& options);

/// Rows that count.
std::vector<Eigen::Index> rows_with_weight(const Table& table);

/// From this many rows on, one fold is held out once instead of every fold in turn.
inline constexpr Eigen::Index single_hold_out_rows = 50000;

/// The folds that the choice is made on: all, the first one for many rows, or none.
std::vector<Fold> selection_folds(Eigen::Index rows, const SelectionOptions& selection);

}  // namespace llmt
