/// \file
/// One accurate tree as a part of a sum.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "boosted/boosting_data.hpp"
#include "boosted/sum_parts.hpp"
#include "llmt/progress.hpp"

namespace llmt {

struct OneTree {
  BoostedTree tree;           ///< of all rows, for the features of the fit
  Eigen::VectorXd residuals;  ///< of every row, of the tree of its fold, which was fitted without it
};

/// The tree that fit() makes with its default options, BoostingData::parts being its folds. It is written as a tree of
/// a sum without its guards. In their place a leaf is held to the values of its own model in the rows that reach it,
/// widened by a tenth. Nothing where a sum cannot say it: categorical inputs, empty cells, products in local models, or
/// more than `most_leaf_slopes` slopes in a leaf.
std::optional<OneTree> one_tree(const BoostingData& data, const Eigen::VectorXd& output, int max_threads, Work& work);

/// What such a tree of the rows `rows.train`, chosen by the rows `rows.held_out`, leaves of these. It takes about a
/// sixth of the time of one_tree().
std::optional<Eigen::VectorXd> held_out_residuals(const BoostingData& data, const Eigen::VectorXd& output,
                                                  const HoldOut& rows, int max_threads, Work& work);

/// The tree as a part of a sum, with its residuals in all rows.
SumPart part_of(const OneTree& one, const Eigen::VectorXd& output, const BinnedRows& rows);

}  // namespace llmt
