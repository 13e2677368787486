/// \file
/// The exact search for the split of a node with the smallest adjusted RSS (docs/algorithms/growth.md, G.7;
/// docs/algorithms/split-search.md).
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "growth/search/adjusted_rss.hpp"
#include "numerics/gram.hpp"

namespace llmt {

/// The best split of a node found so far, or none.
struct SplitCandidate {
  int input = -1;         ///< column that is split; -1: there is no admissible split
  Eigen::Index left = 0;  ///< rows of the left child: the first `left` in the order of that input
  double rss = 0.0;       ///< weighted residual sum of squares of the two child models
  double adjusted = 0.0;  ///< adjusted RSS, by which splits are compared
  int rank_left = 0;      ///< ranks of the two children's least-squares problems
  int rank_right = 0;
  Eigen::Index tested = 0;       ///< number of admissible splits among which it is the best
  Eigen::Index evaluations = 0;  ///< number of splits whose residual sum of squares was computed
  /// Search by bins: the last bin of the left child, and the largest value in it that goes left. RA: the threshold.
  int bin = -1;
  double last_left = std::numeric_limits<double>::infinity();
  bool by_missing = false;      ///< rows with a value go left, rows without one right
  std::vector<int> level_side;  ///< categorical input: -1 left, 1 right, 0 not seen, one per level
};

/// The rows of a node, for the search of its split.
struct SearchNode {
  const Features& features;        ///< regressors about orthogonal in the node
  const Eigen::VectorXd& weights;  ///< of the outputs' residual sums of squares
  double rss;                      ///< weighted, of the node's own model
  double weight;                   ///< sum of the rows' weights
  int rank;                        ///< of the node's own model

  AdjustedRss scale() const { return {weight, rank, rss}; }
};

/// Exact search along one numeric input. It has two steps, so that the best value that one input has found bounds the
/// search of all inputs of the node. Values are adjusted RSS.
///
/// The first step evaluates the edges between blocks of rows. The second step cuts those blocks into parts whose bound
/// (S.1) is not above the best value known, evaluates the edges between the parts, and so on. Sums are only added to,
/// from the left and from the right, and never subtracted from, so that no digits are lost at the ends.
///
/// Compares every split between two distinct values that leaves `min_leaf_samples` rows on either side and no child
/// with a direction that the two rows next to the split decide. Rows without a value are on neither side; only the RSS
/// of the other rows is compared. Of splits that agree within `tie_tolerance` times node.rss, the one with the smallest
/// threshold is taken.
class InputSearch {
 public:
  /// `values`: of the input, ascending; `order`: the rows of the features in the same order. `node`'s members and
  /// `order` must live as long as this.
  InputSearch(const SearchNode& node, std::vector<double> values, std::span<const int> order,
              Eigen::Index min_leaf_samples);

  /// Rows on one side of a stretch, whose Gram matrix is known, and their residual sum of squares and rank.
  struct Beyond {
    Eigen::Index rows;
    const double* gram;
    double rss;
    int rank;
  };

  /// The same for a stretch of an input whose other rows lie in front of the stretch or behind it. search_edges() must
  /// not be called then. SplitCandidate::left counts all rows on the left.
  InputSearch(const SearchNode& node, std::vector<double> values, std::span<const int> order,
              Eigen::Index min_leaf_samples, const Beyond& front, const Beyond& behind);

  /// First step: evaluates the edges of the blocks.
  void search_edges();

  /// Most doubles that the first step takes for the Gram matrices of `rows` rows.
  static Eigen::Index size_of_sums(const GramShape& shape, Eigen::Index rows);

  /// Frees the Gram matrices of the first step. The second step forms them anew if it needs them.
  void forget_sums();

  /// Smallest adjusted RSS found so far; infinity if there is none.
  double smallest() const { return smallest_; }

  /// Number of admissible splits.
  Eigen::Index tested() const { return tested_; }

  /// Second step: searches the blocks that may hold a split with an adjusted RSS of at most `limit`.
  void refine(double limit);

  /// The best split found, exact if its adjusted RSS is not above the limit. `input` is 0, or -1 if no split was found.
  SplitCandidate best() const;

 private:
  /// Rows begin ... end - 1, with the sums on either side of them.
  struct Segment {
    Eigen::Index begin;
    Eigen::Index end;
    const double* left;   // Gram matrix of the rows before
    const double* right;  // and of those behind
    double rss_left;      // their residual sums of squares
    double rss_right;
    int rank_left;  // and at most their ranks
    int rank_right;
    double bound() const { return rss_left + rss_right; }
  };
  struct Found {
    Eigen::Index left;
    double rss;
    double adjusted;
    int rank_left;
    int rank_right;
  };
  /// Either side of the inner edges, that is of all but the first and the last.
  struct Sides : SidesOfCuts {
    std::vector<double> parts;  // Gram matrices between the edges
  };

  bool admissible(Eigen::Index left) const;
  bool holds_candidates(const Segment& segment) const;
  bool may_hold_the_best(const Segment& segment) const;
  void take_ranks_at_the_ends();
  bool rests_on_two_rows(const Segment& segment, const std::vector<Eigen::Index>& edges, const Sides& sides,
                         Eigen::Index at);
  void sum_sides(const std::vector<Eigen::Index>& edges, const double* before, const double* behind,
                 Sides& sides) const;
  void take_sides(const std::vector<Eigen::Index>& edges, const double* before, const double* behind, Sides& sides);
  void offer(const Segment& segment, const std::vector<Eigen::Index>& edges, const Sides& sides);
  void look_into(const Segment& segment, std::size_t depth);
  std::vector<Segment> cut(const Segment& segment, const std::vector<Eigen::Index>& edges, const Sides& sides) const;

  SearchNode node_;
  std::vector<double> values_;
  std::span<const int> order_;
  Eigen::Index min_leaf_samples_;
  Eigen::Index rows_at_the_ends_;  // that decide the ranks of all_
  Eigen::Index rows_in_front_ = 0;
  Eigen::Index rows_behind_ = 0;
  GramShape shape_;
  ResidualSums sums_;
  AdjustedRss scale_;
  Eigen::Index tested_ = 0;
  Eigen::Index evaluations_ = 0;
  double without_value_ = 0.0;  // part of node.rss that falls on the rows without a value, the same for all splits
  bool forgotten_ = false;      // the sums of sides_
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

/// As above, from the Gram matrices and row counts of the levels. `scale`: of the node; `without_value`: part of its
/// RSS that falls on the rows without a level.
SplitCandidate search_level_grams(const GramShape& shape, const Eigen::VectorXd& weights, const AdjustedRss& scale,
                                  double without_value, std::span<const double> grams,
                                  std::span<const Eigen::Index> counts, Eigen::Index min_leaf_samples);

/// The best of the splits of the inputs, with the input's position as `input`; of equally good ones the first. `tested`
/// and `evaluations` are sums over all inputs. `node_rss`: of the node's own model.
SplitCandidate first_of_best(std::span<const SplitCandidate> found, double node_rss);

/// Splits whose adjusted RSS differ by less than this part of the node's RSS count as equally good. Rounding depends on
/// the order of the rows and on columns that carry no information, and must not decide between them.
inline constexpr double tie_tolerance = 1e-10;

}  // namespace llmt
