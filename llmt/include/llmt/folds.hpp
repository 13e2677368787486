/// \file
/// Which rows are held out: for the choice of the leaf count, for calibration and for discovery.
///
///     for (const llmt::Fold& fold : llmt::make_folds(inputs.rows(), {.count = 5})) {
///       const Eigen::MatrixXd train = inputs(fold.train, Eigen::all);
///     }
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "llmt/abi.hpp"

namespace llmt {

/// How rows are dealt to folds.
enum class FoldKind {
  random,     ///< shuffled, then dealt out evenly; flatters data measured along a path or a grid
  contiguous  ///< consecutive blocks in row order: the honest choice when neighbouring rows resemble each other
};

struct FoldOptions {
  int count = 5;                     ///< number of folds K, at least 2; as many as groups gives leave-one-out
  FoldKind kind = FoldKind::random;  ///< how rows are dealt to folds
  std::uint64_t seed = 1;            ///< for FoldKind::random
};

/// The rows of one fold, ascending.
struct Fold {
  std::vector<Eigen::Index> train;     ///< rows outside the fold
  std::vector<Eigen::Index> held_out;  ///< rows inside the fold
};

/// Partitions the rows 0 ... rows-1 into K folds whose sizes, counted in groups, differ by at most one.
///
/// `groups`: one label a row; rows with equal labels (repeats of a pose) share a fold. Empty: each row is a group of
/// its own. Every row is held out exactly once. Groups are taken in order of first appearance. Throws
/// std::invalid_argument if there are fewer groups than folds, fewer than two folds, or a label count other than
/// `rows`.
std::vector<Fold> make_folds(Eigen::Index rows, const FoldOptions& options, std::span<const double> groups = {});

}  // namespace llmt
