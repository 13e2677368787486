/// \file
/// Which of the trees that were compared are worth a person's time: one for each number of rules.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "readable/input_walk.hpp"

namespace llmt {

/// The trees of one key: of each fold and of all rows.
struct ComparedTree {
  TreeKey key;
  bool has_products = false;
  std::vector<TreeExtent> extents;  ///< of the folds' trees and, last, that of all rows
  std::vector<double> squares;      ///< weighted squared errors of the folds' trees over their held-out rows
};

/// What the trees of a path are measured by.
struct PathRule {
  double loss = 0.0;
  double least = 0.0;                              ///< errors below are rounding
  std::vector<double> weights;                     ///< total weight of each fold's held-out rows
  std::vector<std::vector<double>> crisp_squares;  ///< as ComparedTree::squares, of each crisp tree of the fit
};

/// Positions in the list of trees.
struct Path {
  std::vector<std::size_t> steps;   ///< one for each number of rules, ascending
  std::vector<Eigen::Index> rules;  ///< of each step
  std::size_t chosen = 0;           ///< position in steps: what is taken where nobody asks for another
  double yardstick = 0.0;           ///< smallest error of the crisp trees of the fit and of the trees without products
  bool is_within_loss = true;       ///< the error of the chosen one is at most (1 + loss) yardstick

  /// The step with the most rules that are at most this many; the first if all have more.
  std::size_t with_rules(Eigen::Index most) const;
};

/// The path as a choice finds it that knows the errors on all folds but `left_out` and the length of that fold's trees;
/// -1: the errors on all folds, and the length of the trees of all rows. `trees`: the first is a constant.
///
/// Trees stand on it that are like those whose errors are known: with as many rules as the middle one of the trees of
/// their key, those of the folds and that of all rows, and no shorter than the middle one.
/// Chosen is the tree with the smallest expression among those whose error is at most (1 + loss) times the yardstick,
/// and that are no worse than sparse least squares: of several rules the error is at most that of the best single
/// equation without products, of one rule at most 2 % above it. If there is none, the one with the smallest error of
/// all is chosen. Of every other number of rules the tree with the smallest expression stands whose error is at most
/// 2 % above the smallest with this number of rules.
Path path_of(const std::vector<ComparedTree>& trees, const PathRule& rule, int left_out);

}  // namespace llmt
