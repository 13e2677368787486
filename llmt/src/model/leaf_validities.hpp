/// \file
/// The leaves whose validity is positive at a point, and their validities (docs/algorithms/validities.md), laid out for
/// evaluation.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <vector>

#include "llmt/model.hpp"
#include "model/local_models.hpp"
#include "model/row_block.hpp"

namespace llmt {

/// A row without a value for a split takes part in the fit of a child if the child has at least this share of it.
inline constexpr double clear_share = 0.9;

/// A leaf that reaches a point.
struct Activation {
  int node = 0;
  double validity = 0.0;
};

/// Immutable after construction.
class LeafValidities {
 public:
  struct Branch {
    int left = -1;
    int right = -1;
    int input = -1;
    int first_level = -1;  // of this split's entries in level_share_; -1: a number
    int levels = 0;
    int first_term = -1;  // of this split's entries in terms_; -1: axis-orthogonal
    int terms = 0;
    double threshold = 0.0;
    double per_half_width = 0.0;  // 1 / half width; 0: a jump
    double missing_left = 0.5;
  };
  /// A term of the direction of an oblique split; inputs of weight 0 have none.
  struct Term {
    int input;
    double weight;
    double centre;
  };
  /// Gaussians of the leaves, in order of growth; rows of `stride` entries, padded with zeros to whole quads.
  struct Gaussians {
    std::vector<int> nodes = {};
    Eigen::Index inputs = 0;
    Eigen::Index stride = 0;
    std::vector<double> centres = {};
    std::vector<double> per_sigma = {};  // 1 / sigma; 0 for an input without extent, or categorical
  };

  /// `inputs`: columns of the model, whose extents close the boxes.
  LeafValidities(const Partition& partition, const std::vector<InputColumn>& inputs);

  /// The leaves whose validity at the inputs `row` is positive, from left to right in the tree (Gaussians: in order of
  /// growth); validities sum to 1.
  void activate(const double* row, std::vector<Activation>& active) const;

  /// The same for a block: each leaf that some row reaches, in that order, with its rows, ascending.
  void for_each_leaf(const RowBlock& block, const std::function<void(int node, const RowList& list)>& visit) const;

  /// Validity of the left child at a split, and its derivative with respect to the number that the split compares.
  double left_share(int node, const double* row) const {
    const Branch& branch = branches_[node];
    return left_share(branch, side(branch, row));
  }
  double left_share_derivative(int node, const double* row) const;
  /// by_input += factor * derivatives, by the inputs, of the number that the split compares.
  void add_side_derivatives(int node, const Eigen::VectorXd& factor, Eigen::MatrixXd& by_input) const;
  /// The number s(x) that the split compares with its threshold.
  double side(int node, const double* row) const { return side(branches_[node], row); }

  /// Whether, at some split that the row reaches, a missing value leaves both children with more than a tenth of it.
  bool is_ambiguous(const double* row) const;
  /// The child that has the larger share of a row.
  int child_of(int node, const double* row) const;

  /// Left and right child of a node, -1 in a leaf.
  int left(int node) const { return branches_[node].left; }
  int right(int node) const { return branches_[node].right; }

  Eigen::Index num_leaves() const { return std::ssize(branches_) / 2 + 1; }
  /// Largest number of splits above a leaf.
  Eigen::Index depth() const { return depth_; }
  const std::vector<Branch>& branches() const { return branches_; }
  const std::vector<double>& level_shares() const { return level_share_; }  ///< of the left child
  const std::vector<Term>& terms() const { return terms_; }
  const Gaussians& gaussians() const { return gaussians_; }
  bool are_gaussian() const { return kind_ == ValidityKind::gaussian; }
  /// Derivatives of the exponents of Gaussians by the inputs, inputs x `active`, the leaves that reach the row.
  Eigen::MatrixXd exponent_derivatives(const std::vector<Activation>& active, const double* row) const;

 private:
  /// Rows on their way down the tree. The rows of a node stand behind the rows that wait for right children above it.
  struct Waiting {
    std::vector<int> rows;
    std::vector<double> validities;
  };
  struct ForkCounts {
    Eigen::Index left = 0;
    Eigen::Index right = 0;
  };

  double side(const Branch& branch, const double* row) const {
    return branch.first_term < 0 ? row[branch.input] : oblique_side(branch, row, 1);
  }
  /// s(x) of an oblique split; successive inputs are `stride` apart. A missing input counts as its centre.
  double oblique_side(const Branch& branch, const double* row, Eigen::Index stride) const {
    double sum = 0.0;
    for (int k = 0; k < branch.terms; ++k) {
      const Term& term = terms_[branch.first_term + k];
      const double x = row[term.input * stride];
      sum += x == x ? term.weight * (x - term.centre) : 0.0;
    }
    return sum;
  }
  double left_share(const Branch& branch, double x) const;
  /// Sends the `count` rows of a node, which stand in `waiting` from `begin` on, to its children: those of the right
  /// child stand there afterwards, those of the left child behind all.
  ForkCounts fork(int node, Eigen::Index begin, Eigen::Index count, const RowBlock& block, Waiting& waiting) const;
  void add_gaussians(const Partition& partition, const std::vector<InputColumn>& inputs);
  /// Exponents of the Gaussians as validities, one of `active` each; returns the largest.
  double set_exponents(const double* row, Activation* active) const;
  void activate_gaussians(const double* row, std::vector<Activation>& active) const;

  ValidityKind kind_;
  int smoothness_;
  std::vector<Branch> branches_;
  Eigen::Index depth_ = 0;
  std::vector<double> level_share_;  // of the left child
  std::vector<Term> terms_;
  Gaussians gaussians_;
};

}  // namespace llmt
