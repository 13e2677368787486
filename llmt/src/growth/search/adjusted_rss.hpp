/// \file
/// Comparing splits of a node whose children have different ranks.
#pragma once

#include <Eigen/Core>
#include <algorithm>

namespace llmt {

/// The **adjusted RSS** of a split, by which the splits of a node are compared (docs/algorithms/growth.md, G.7): the
/// sum of the two children's RSS times a factor that is 1 if both have the rank of the node, and below 1 if they have
/// fewer coefficients.
class AdjustedRss {
 public:
  /// `weight`, `rank` and `rss`: sum of the weights of the node's rows, rank and RSS of its own model.
  AdjustedRss(double weight, int rank, double rss) : weight_(weight), rank_(rank), rss_(rss) {}

  double of_node() const { return rss_; }  ///< RSS of the node's own model

  /// Rows from which on a child's rank is its own. One with fewer counts as one of full rank: it may lack directions
  /// only because it lacks rows.
  Eigen::Index enough_rows() const { return 2 * static_cast<Eigen::Index>(rank_); }

  /// The rank of a child, at most that of the node. In features that depend on each other in the node, rounding can
  /// pass for a direction.
  int of_child(int rank) const { return std::min(rank, rank_); }

  /// The rank of a child as it counts.
  int counted(int rank, Eigen::Index rows) const { return rows < enough_rows() ? rank_ : of_child(rank); }

  /// The adjusted RSS of a split; `ranks`: sum of the ranks of its children. It rises with both.
  double of(double rss, int ranks) const {
    const double of_full = weight_ - 2.0 * rank_;
    if (ranks == 2 * rank_ || !(of_full > 0.0) || !(weight_ > ranks)) return rss;
    return rss * of_full / (weight_ - ranks);
  }

 private:
  double weight_;
  int rank_;
  double rss_;
};

}  // namespace llmt
