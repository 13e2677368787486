/// \file
/// The exact search for the split of a node whose two least-squares models leave the least.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "numerics/gram.hpp"

namespace llmt {

/// The best split of a node found so far, or none.
struct SplitCandidate {
  int input = -1;         ///< column that is split; -1: there is no admissible split
  Eigen::Index left = 0;  ///< rows of the left child: the first `left` in the order of that input
  double rss = 0.0;       ///< weighted residual sum of squares of the two child models
  int rank_left = 0;      ///< ranks of the two children's least-squares problems
  int rank_right = 0;
  Eigen::Index tested = 0;       ///< number of admissible splits among which it is the best
  Eigen::Index evaluations = 0;  ///< number of splits whose residual sum of squares was computed
  /// Search by bins: the last bin of the left child, and the largest of its values that go left. RA: the threshold.
  int bin = -1;
  double last_left = std::numeric_limits<double>::infinity();
  bool by_missing = false;      ///< rows with a value go left, rows without one right
  std::vector<int> level_side;  ///< categorical input: -1 left, 1 right, 0 not seen, one per level
};

/// What the search of a node needs to know of its rows.
struct SearchNode {
  const Features& features;        ///< regressors about orthogonal in the node
  const Eigen::VectorXd& weights;  ///< of the outputs' residual sums of squares
  double rss;                      ///< weighted, of the node's own model
};

/// Exact search along one numeric input, in two steps so that all inputs of a node can share what they have found.
///
/// The least of a sum of squares cannot fall when terms are added. Along a sorted input the residual sum of squares of
/// the left rows therefore never falls and that of the right rows never rises, and every split between the positions a
/// < b leaves at least RSS_left(a) + RSS_right(b). The first step takes the sums at the edges of blocks of rows; the
/// second looks only into blocks whose bound is not above the best split known, which it cuts into parts, and so on.
/// Sums are only ever added to, from the left and from the right, never subtracted from: no digits are lost at the
/// ends.
///
/// Compares every split between two distinct values that leaves `min_leaf_samples` rows on either side. Rows without a
/// value take part in neither side; the gain of the others is what counts. Of splits that agree within `tie_tolerance`
/// times node.rss, the one with the smallest threshold is taken.
class InputSearch {
 public:
  /// `values` are the input's values and `order` the rows of the features, both ascending in the value. What is
  /// referred to must live as long as this.
  InputSearch(const SearchNode& node, std::vector<double> values, std::span<const int> order,
              Eigen::Index min_leaf_samples);

  /// Rows on one side of a stretch, whose Gram matrix and residual sum of squares are known.
  struct Beyond {
    Eigen::Index rows;
    const double* gram;
    double rss;
  };

  /// The same for a stretch of an input whose other rows lie in front of it or behind: only refine() is of use, and
  /// splits are named by the number of all rows on their left.
  InputSearch(const SearchNode& node, std::vector<double> values, std::span<const int> order,
              Eigen::Index min_leaf_samples, const Beyond& front, const Beyond& behind);

  /// Looks at the edges of the blocks.
  void search_edges();

  /// Smallest residual sum of squares found so far; infinity if there is none.
  double smallest() const { return smallest_; }

  /// Number of admissible splits.
  Eigen::Index tested() const { return tested_; }

  /// Looks into the blocks that may hold a split of at most `limit`.
  void refine(double limit);

  /// The best split found; `input` is 0, or -1 if nothing is admissible or not above the limit. Exact if its sum is not
  /// above the limit.
  SplitCandidate best() const;

 private:
  /// Rows begin ... end - 1, and what is known at its ends.
  struct Segment {
    Eigen::Index begin;
    Eigen::Index end;
    const double* left;   // Gram matrix of the rows before
    const double* right;  // and of those behind
    double rss_left;      // their residual sums of squares
    double rss_right;
    double bound() const { return rss_left + rss_right; }
  };
  struct Found {
    Eigen::Index left;
    double rss;
    int rank_left;
    int rank_right;
  };
  /// Gram matrices on either side of some edges, and what follows from them.
  struct Sides {
    std::vector<double> parts;  // between the edges
    std::vector<double> left;
    std::vector<double> right;
    std::vector<double> rss_left;
    std::vector<double> rss_right;
    std::vector<int> rank_left;
    std::vector<int> rank_right;
  };

  bool admissible(Eigen::Index left) const;
  bool holds_candidates(const Segment& segment) const;
  void take_sides(const std::vector<Eigen::Index>& edges, const double* before, const double* behind, Sides& sides);
  void offer(const std::vector<Eigen::Index>& edges, const Sides& sides);
  void look_into(const Segment& segment, std::size_t depth);
  std::vector<Segment> cut(const Segment& segment, const std::vector<Eigen::Index>& edges, const Sides& sides) const;

  SearchNode node_;
  std::vector<double> values_;
  std::span<const int> order_;
  Eigen::Index min_leaf_samples_;
  Eigen::Index rows_in_front_ = 0;
  Eigen::Index rows_behind_ = 0;
  GramShape shape_;
  ResidualSums sums_;
  Eigen::Index tested_ = 0;
  Eigen::Index evaluations_ = 0;
  double without_value_ = 0.0;  // what the rows without a value leave, whatever the split
  double limit_;
  double smallest_;
  std::vector<Found> found_;  // within the tolerance of the smallest
  std::vector<double> none_;  // Gram matrix of no rows
  Segment all_;
  std::vector<Eigen::Index> edges_;
  Sides sides_;
  std::vector<Sides> deeper_;
};

/// The best split on a categorical input: `levels` has the level of each row of `node.features`, or -1.
///
/// Tries the levels in ascending order of the mean of the residuals, and of the residuals times each regressor, split
/// between any two: all splits for two levels, all that matter for one-dimensional scores (Fisher 1958) for more.
SplitCandidate search_levels(const SearchNode& node, std::span<const int> levels, int num_levels,
                             Eigen::Index min_leaf_samples);

/// As above, from the Gram matrices and row counts of the levels; `without_value`: see InputSearch.
SplitCandidate search_level_grams(const GramShape& shape, const Eigen::VectorXd& weights, double node_rss,
                                  double without_value, std::span<const double> grams,
                                  std::span<const Eigen::Index> counts, Eigen::Index min_leaf_samples);

/// Of the best splits of the inputs, in order, the best one, its `input` the position; equally good: the first. Tested
/// and evaluated are those of all. `node_rss`: of the node's own model.
SplitCandidate first_of_best(std::span<const SplitCandidate> found, double node_rss);

/// Rounding differs with the order of rows and with columns that carry no information; ties must not depend on it.
inline constexpr double tie_tolerance = 1e-10;

}  // namespace llmt
