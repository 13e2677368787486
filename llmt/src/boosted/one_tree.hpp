/// \file
/// One accurate tree as a part of a sum.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "boosted/boosting.hpp"
#include "boosted/boosting_data.hpp"
#include "llmt/options.hpp"
#include "llmt/progress.hpp"

namespace llmt {

struct OneTree {
  BoostedTree tree;           ///< of all rows, for the features of the fit
  Eigen::VectorXd residuals;  ///< of every row, of the tree of its fold, which was fitted without it
};

/// The tree that fit() makes by the regime's rule with at most 24 leaves, BoostingData::parts being its folds. It is
/// written as a tree of a sum without its guards. In their place a leaf is held to the values of its own model in the
/// rows that reach it, widened by a tenth. Nothing where a sum cannot say it: categorical inputs, empty cells, products
/// in local models, or more than `most_leaf_slopes` slopes in a leaf; nor where the regime has no rules for it.
std::optional<OneTree> one_tree(const BoostingData& data, const Eigen::VectorXd& output, int max_threads, Work& work);

/// A tree of some rows, chosen by others.
struct TriedTree {
  Eigen::VectorXd residuals;  ///< of the rows that chose it
  FitOptions options;         ///< for the same tree of all rows, with nothing left to choose
};

/// The tree of the rows `rows.train` that the rows `rows.held_out` choose, grown by one of the rules. Nothing as
/// one_tree().
std::optional<TriedTree> try_tree(const BoostingData& data, const Eigen::VectorXd& output, const HoldOut& rows,
                                  std::span<const GrowthRule> rules, int max_threads, Work& work);

/// The same tree, fitted to all rows. Nothing if a sum cannot say it.
std::optional<BoostedTree> tree_of_all(const BoostingData& data, const Eigen::VectorXd& output, const TriedTree& tried,
                                       Work& work);

/// The residuals of the rows `rows.held_out`, of the same tree fitted to the rows `rows.train`. Nothing as
/// tree_of_all().
std::optional<Eigen::VectorXd> residuals_without(const BoostingData& data, const Eigen::VectorXd& output,
                                                 const HoldOut& rows, const FitOptions& options, Work& work);

/// The tree as a part of a sum, with its residuals in all rows.
SumPart part_of(const BoostedTree& tree, const Eigen::VectorXd& output, const BinnedRows& rows);

}  // namespace llmt
