/// \file
/// Inequalities between the leaves on either side of splits on monotone inputs (docs/algorithms/constraints.md).
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "constraints/leaf_pairs.hpp"
#include "data/dataset.hpp"

namespace llmt {

/// An inequality between the local models [value, slopes] of two leaves of one output:
///   of_left . left model + of_right . right model >= bound.
struct LeafInequality {
  int left = 0;  ///< nodes
  int right = 0;
  Eigen::VectorXd of_left;
  Eigen::VectorXd of_right;
  double bound = 0.0;
};

/// The conditions under which the prediction of one output is monotone, everywhere, in every input that is to be
/// monotone. With f_l, f_r the guarded local models of a leaf on either side of a split on such an input j, the
/// derivative of the prediction with respect to x_j is a sum, weighted with validities, over splits and pairs of leaves
/// of eq. (O.1),
///   s_l g f_l' + (1 - g) s_r f_r' + |g'| (f_r - f_l) / h.
/// So it is enough that none of these is negative where both leaves have validity; for a crisp split, that f_r >= f_l.
/// They are bounded from below by Bernstein coefficients, which are linear in the coefficients of the leaves.
///
/// The **margin** of a condition is by how much f_r - f_l could be lower, in the unit of the output; it is negative if
/// the condition is violated.
///
/// Requires that the slopes have the sign, and that prepare_ordered_splits() has been called. Slopes, ranges and half
/// widths of inner nodes are those of `partition`; the leaves' models are passed with each call.
class OrderedSplits {
 public:
  OrderedSplits(const Partition& partition, const TrainingRows& training, Eigen::Index output);

  bool empty() const { return pairs_.pairs.empty(); }

  /// The inequalities with a margin below `least`: of every leaf on either side of every split the one with the
  /// smallest margin. `models`: of all nodes, [value, slopes] in columns. The bounds are such that the margin becomes
  /// `margin`.
  std::vector<LeafInequality> violated(const Eigen::MatrixXd& models, double least, double margin) const;

  /// The smallest margin of all conditions. If it is not negative, the prediction is monotone.
  double smallest_margin(const Eigen::MatrixXd& models) const;

  /// Moves the leaves on the two sides of every split apart, all of one side by the same value, so that the margin is
  /// at least half of `margin`; moved splits get all of it. The lowest splits come first: then no move undoes another.
  void separate(Eigen::MatrixXd& models, double margin) const;

 private:
  /// The point at which the condition of a pair has its smallest margin.
  struct Worst {
    double margin;
    LeafPairs::Coefficient coefficient;
    std::vector<LeafPairs::Option> options;
  };

  Worst worst(const LeafPairs::Pair& pair, const Eigen::MatrixXd& models) const;
  LeafInequality inequality(const LeafPairs::Pair& pair, const Worst& worst, Eigen::Index size, double margin) const;

  std::vector<std::vector<int>> below_;  // leaves at or below each node
  std::vector<std::pair<int, int>> children_;
  LeafPairs pairs_;
};

}  // namespace llmt
