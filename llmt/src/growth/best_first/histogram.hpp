/// \file
/// The rows of a growing tree in bins, and sums over the bins.
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "growth/best_first/bins.hpp"
#include "growth/best_first/whitened_rows.hpp"
#include "growth/search/split_search.hpp"

namespace llmt {

/// Gram matrices and row counts of the bins of all split inputs.
struct Histogram {
  std::vector<double> grams;
  std::vector<Eigen::Index> counts;
};

/// The features of all training rows and the bins of their inputs.
class BinnedRows {
 public:
  explicit BinnedRows(const GrowthData& data);

  WhitenedRows& whitened() { return whitened_; }
  const WhitenedRows& whitened() const { return whitened_; }
  Eigen::Index num_bins() const { return first_bin_.back(); }  ///< of all inputs

  Histogram accumulate(const std::vector<int>& rows) const;

  /// Gram matrix of all rows of a histogram.
  std::vector<double> total(const Histogram& histogram) const;

  /// The best split of the rows of a histogram. Compares the edges between bins, then searches those bins exactly whose
  /// bounds allow a better split, of at most `limit`, the most promising first, while they hold at most half of the
  /// rows. `excess`: what a split in one of the other bins could gain on the result, at most.
  SplitCandidate search(const Histogram& histogram, const std::vector<int>& rows, double node_rss, int rank,
                        double& excess) const;

  /// The largest value on the left of a split on a number, and the smallest on its right.
  std::pair<double, double> gap(const std::vector<int>& rows, const SplitCandidate& split) const;

  /// The side of a split on which a row lies.
  bool goes_left(int row, const SplitCandidate& split) const;

 private:
  /// What the edges of one input's bins have told, and what is needed to look into the bins.
  struct Edges {
    SplitCandidate best;
    std::vector<Eigen::Index> bins;  // those with rows
    std::vector<Eigen::Index> rows_before;
    std::vector<double> grams_left;  // of the rows up to each edge
    std::vector<double> grams_right;
    std::vector<double> rss_left;
    std::vector<double> rss_right;
    std::vector<double> bounds;  // of splits inside each bin; infinity if there are none
  };

  const Features& features() const { return whitened_.features(); }
  std::span<const double> grams(const Histogram& histogram, std::size_t input) const;
  std::span<const Eigen::Index> counts(const Histogram& histogram, std::size_t input) const;
  Edges search_edges(const Histogram& histogram, std::size_t input, double node_rss) const;
  SplitCandidate look_into(const Edges& edges, const std::vector<std::size_t>& chosen, std::size_t input,
                           const std::vector<int>& rows, double node_rss, double limit) const;

  const GrowthData& data_;
  BinnedInputs inputs_;
  std::vector<Eigen::Index> first_bin_;  // of each input among all bins
  WhitenedRows whitened_;
  GramShape shape_;
};

}  // namespace llmt
