/// \file
/// The folds of a fit.
#pragma once

#include <span>
#include <vector>

#include "data/dataset.hpp"
#include "llmt/folds.hpp"

namespace llmt {

/// What a fold trains on, and what it holds out.
struct FoldRows {
  TrainingRows training;
  TrainingRows held_out;
};

/// From this many rows on, one fold is held out once instead of every fold in turn.
inline constexpr Eigen::Index single_hold_out_rows = 50000;

/// The folds on which a fit chooses: FoldOptions::count of them, fewer where there are fewer rows or groups, the first
/// one alone for many rows, none for count 0 or a single group. Throws std::invalid_argument for a count of 1 or below
/// 0.
std::vector<Fold> selection_folds(Eigen::Index rows, FoldOptions options, std::span<const double> groups = {});

/// The rows of a table as each fold has them. `measured`: the same rows with the weights that they have in errors.
std::vector<FoldRows> deal(const Table& table, const Table& measured, const std::vector<Fold>& folds, int max_threads);

}  // namespace llmt
