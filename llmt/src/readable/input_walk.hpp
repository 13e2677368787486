/// \file
/// Trees with ever fewer inputs, and what each of them costs at every price of a symbol.
#pragma once

#include <vector>

#include "growth/problem.hpp"
#include "readable/equation_tree.hpp"

namespace llmt {

/// How trees are made.
struct TreePlan {
  GrowthOptions growth;  ///< split_inputs: all that may be split
  int max_threads = 1;
};

/// How equations are written.
struct Form {
  bool products = false;  ///< with products and squares of inputs
  double coarseness = 1.0;
  bool splits = true;  ///< else one rule: sparse least squares
};

/// The forms that are compared, the simplest first.
const std::vector<Form>& forms();

/// Which tree: its place in a walk, its form, and the price at which it is pruned.
struct TreeKey {
  std::size_t step = 0;
  std::size_t form = 0;
  std::size_t price = 0;
  auto operator<=>(const TreeKey&) const = default;
};

/// A pruned tree.
struct JudgedTree {
  double held_out_error = 0.0;  ///< weighted sum of squares
  TreeExtent extent;
};

/// A tree of a walk.
struct WalkStep {
  std::vector<int> inputs;                     ///< that it may use, ascending
  std::vector<int> growth_inputs;              ///< of the local models with which its splits were searched
  std::vector<std::vector<JudgedTree>> trees;  ///< of every form and price
};

/// The tree of a step, before it is pruned.
EquationTree make_tree(const Sample& sample, const TreePlan& plan, const WalkStep& step, const Form& form);

/// The price of a symbol, as a mean square error.
double price_of(const EquationTree& tree, std::size_t price);

/// Walks from the tree with all inputs to one with a single input: of D inputs the ceil(0.7 D) that matter most to the
/// cheapest tree at the Schwarz price go on. The number of inputs of a step depends on the number at the start alone.
/// `work`: of this walk.
std::vector<WalkStep> walk_inputs(const Sample& sample, const TreePlan& plan, Work& work);

}  // namespace llmt
