/// \file
/// The rows of a growing tree in bins, and sums over the bins.
#pragma once

#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "growth/best_first/bins.hpp"
#include "growth/best_first/whitened_rows.hpp"
#include "growth/search/split_search.hpp"

namespace llmt {

/// Gram matrices and row counts of the bins of a split input.
struct InputHistogram {
  std::vector<double> grams;
  std::vector<Eigen::Index> counts;

  static auto fields(auto& self) { return std::tie(self.grams, self.counts); }
};

/// The histograms of all split inputs, or of some of them.
using Histogram = std::vector<InputHistogram>;

/// Takes the rows of `less` out of `histogram`.
void subtract(const Histogram& less, Histogram& histogram);

/// The features of all training rows and the bins of their inputs.
class BinnedRows {
 public:
  explicit BinnedRows(const GrowthData& data);

  /// The same before the inputs are cut: at most so many.
  static Eigen::Index largest_histogram(const GrowthData& data);

  WhitenedRows& whitened() { return whitened_; }
  const WhitenedRows& whitened() const { return whitened_; }
  /// Doubles that the histogram of a node takes.
  Eigen::Index size_of_histogram() const { return num_bins_ * shape_.size(); }

  Histogram accumulate(const std::vector<int>& rows) const;

  /// Gram matrix of all rows of a histogram.
  std::vector<double> total(const Histogram& histogram) const;

  /// The best split of the rows of a histogram (docs/algorithms/split-search.md, "Search by bins"). Compares the edges
  /// between bins, then searches those bins exactly whose bound (S.1) allows a better split that can pass the F test,
  /// the lowest bound first, while they hold at most half of the rows. `rows`: those of the histogram; `node_rss` and
  /// `rank`: of the node's model. Sets `excess` to what the adjusted RSS of a split inside one of the other bins could
  /// be below that of the result, at most.
  SplitCandidate search(const Histogram& histogram, const std::vector<int>& rows, double node_rss, int rank,
                        double& excess) const;

  /// The largest value on the left of a split on a number, and the smallest on its right.
  std::pair<double, double> gap(const std::vector<int>& rows, const SplitCandidate& split) const;

  /// The side of a split on which a row lies.
  bool goes_left(int row, const SplitCandidate& split) const;

 private:
  /// Splits at the edges between the bins of one input, and what the search inside the bins starts from.
  struct Edges : SidesOfCuts {
    SplitCandidate best;
    std::vector<Eigen::Index> bins;  // those with rows
    std::vector<Eigen::Index> rows_before;
    std::vector<double> bounds;  // of the RSS of splits inside each bin; infinity if there are none
    std::vector<int> ranks;      // and of the sum of their ranks
  };

  /// A bin that may hold a better split inside.
  struct PromisingBin {
    double bound;  // of the adjusted RSS
    std::size_t input;
    std::size_t position;  // among the bins with rows
  };

  struct ChosenBins {
    std::vector<std::vector<std::size_t>> of_input;  // positions among the bins with rows
    Eigen::Index rows;                               // number of rows in the chosen bins and the first one left out
    double first_bound_left_out;                     // infinity if no bin was left out
  };

  const Features& features() const { return whitened_.features(); }
  void add(std::span<const int> rows, std::size_t input, std::vector<int>& sorted, InputHistogram& histogram) const;
  Edges search_edges(const Histogram& histogram, const std::vector<int>& node_rows, std::size_t input,
                     const AdjustedRss& scale) const;
  bool rests_on_two_rows(const Edges& edges, std::size_t at, std::size_t input,
                         const std::vector<int>& node_rows) const;
  SplitCandidate best_edge(const Edges& edges, std::span<const Eigen::Index> rows, const std::vector<int>& node_rows,
                           std::size_t input, const AdjustedRss& scale) const;
  void bound_bins(Edges& edges, std::span<const Eigen::Index> rows, std::size_t input) const;
  std::vector<std::vector<int>> rows_in_bins(const Edges& edges, const std::vector<std::size_t>& chosen,
                                             std::size_t input, const std::vector<int>& rows) const;
  static std::vector<PromisingBin> promising_bins(const std::vector<Edges>& edges, const AdjustedRss& scale,
                                                  double smallest);
  static ChosenBins choose_bins(const std::vector<PromisingBin>& promising, const std::vector<Edges>& edges,
                                Eigen::Index rows);
  static SplitCandidate best_of(const std::vector<Edges>& edges, const std::vector<SplitCandidate>& inside,
                                double node_rss);
  SplitCandidate look_into(const Edges& edges, const std::vector<std::size_t>& chosen, std::size_t input,
                           const std::vector<int>& rows, const SearchNode& node, double limit) const;

  const GrowthData& data_;
  BinnedInputs inputs_;
  WhitenedRows whitened_;
  GramShape shape_;
  Eigen::Index num_bins_ = 0;  // of all inputs
};

}  // namespace llmt
