/// \file
/// A grown tree whose leaves may have equations of any length, and what each costs.
#pragma once

#include <Eigen/Core>
#include <map>
#include <vector>

#include "readable/cost_complexity.hpp"
#include "readable/leaf_equations.hpp"
#include "readable/sample.hpp"

namespace llmt {

/// How long a tree is.
struct TreeExtent {
  Eigen::Index size = 0;        ///< of the expression, as expression_size() counts
  Eigen::Index rules = 0;       ///< leaves
  Eigen::Index most_terms = 0;  ///< of the leaf that has most
};

class EquationTree {
 public:
  /// `grown`: the nodes of a tree, of which only the splits count. Thresholds and coefficients are rounded: those that
  /// change predictions by less than `coarseness` times the noise are not told apart (docs/algorithms/readable.md).
  /// `sample` must live as long as the tree.
  EquationTree(const Sample& sample, std::vector<Node> grown, std::vector<Term> terms, double coarseness);

  /// The cheapest tree at a price for one symbol, in mean square error: see cheapest_tree(). Where trends are asked
  /// for, slopes have their signs, and of a monotone input a split at which a prediction steps against the trend is
  /// undone, the lowest first.
  std::vector<int> pruned(double price);

  /// The price of a symbol at which a term pays if it lowers the sum of squares by ln N times the variance that the
  /// cheapest tree at this very price leaves (Schwarz 1978): prices from that of the constant down are tried.
  double schwarz_price() const;

  /// By how much each input of the model lowers the mean square error: its terms, and the subtrees below its splits.
  Eigen::VectorXd importance(const std::vector<int>& pruned) const;

  /// Weighted squared error of the rounded tree over the held-out rows.
  double held_out_error(const std::vector<int>& pruned);

  /// Of the rounded tree.
  TreeExtent extent(const std::vector<int>& pruned);

  /// Mean square error over the training rows that a constant leaves.
  double variance() const { return priced_[0].errors[0]; }

  /// The rounded tree. Regressors: those of sample.described and then `products`.
  Partition partition(const std::vector<int>& pruned, const std::vector<Term>& products);

  /// The products among the terms of the leaves and inner nodes.
  std::vector<Term> products_in(const std::vector<int>& pruned) const;

 private:
  struct Made {
    Equation equation;
    double held_out_error = 0.0;
  };

  void settle_splits(double coarseness);
  bool settle(std::size_t node, double coarseness);
  void add_sums();
  void price_nodes();
  void choose_grains(double coarseness);
  const Made& made(int node, int terms);
  SelectionPath signed_path(const LocalSums& sums, Eigen::Index most) const;
  Eigen::Index wrong_term(const LocalSums& sums, const SelectionPath& path) const;
  int last_disorder(const std::vector<int>& pruned);
  double held_out_error(int node, const Equation& equation) const;
  int equation_of(const std::vector<int>& pruned, int node) const;
  double held_term(const Term& term, const double* row, bool is_root) const;
  Node described(int node, int terms, const std::vector<Term>& products);

  const Sample& sample_;
  std::vector<Node> nodes_;
  std::vector<Term> terms_;
  std::vector<Parents> parents_;  // of each term, positions of the main terms of a product
  Origin origin_;
  std::vector<std::vector<int>> training_;  // rows of every node
  std::vector<std::vector<int>> held_out_;
  std::vector<LocalSums> sums_;
  std::vector<SelectionPath> paths_;
  std::vector<PricedNode> priced_;
  Grains grains_;
  std::map<std::pair<int, int>, Made> made_;  // by node and number of terms
};

}  // namespace llmt
