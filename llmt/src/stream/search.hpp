/// \file
/// How a leaf of a stream finds its split.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "stream/setting.hpp"
#include "stream/sums.hpp"

namespace llmt {

/// A split to make.
struct StreamSplit {
  int input = -1;
  double threshold = 0.0;
  double reach = 0.0;  ///< distance to the edges beside the threshold
  Sums left;           ///< of the rows that decided it, in the leaf's basis
  Sums right;
  double gain = 0.0;  ///< decrease of the mean squared residual
};

/// The search for a leaf's split by residual differences (docs/algorithms/stream.md).
///
/// The first rows are kept; their quantiles become the edges between the bins of each input. From then on only the sums
/// of each bin of each input are kept. Every edge is a candidate. A test is due whenever the number of rows has grown
/// by a quarter; the k-th test is made at significance / (k (k + 1)), eq. (T.1).
class LeafSearch {
 public:
  /// Rows whose quantiles become the edges between bins.
  static constexpr Eigen::Index rows_before_bins = 64;

  explicit LeafSearch(const StreamSetting& setting);

  /// `products`: of the row in the leaf's basis.
  void add(const StreamRow& row, const Basis& basis, const RowProducts& products);

  /// The split to make, if a test is due and finds one. `low`, `high`: range of the inputs in the leaf.
  std::optional<StreamSplit> test(const Eigen::VectorXd& low, const Eigen::VectorXd& high, double different);

  /// The residual sums of squares for the edges between the bins of an input; empty before bins are laid out.
  struct Edges : SidesOfCuts {
    std::vector<double> thresholds;
    std::vector<Eigen::Index> rows_left;
    Eigen::Index rows = 0;  ///< in all bins
    double rss = 0.0;       ///< of one model
    int rank = 0;
  };
  Edges edges(int input);

  Eigen::Index bytes() const;

 private:
  friend struct StreamJson;
  /// Bins of one input: bin b holds edges[b - 1] < x <= edges[b].
  struct Bins {
    std::vector<double> edges;
    std::vector<double> grams;  // edges.size() + 1 of them
    std::vector<Eigen::Index> rows;
  };
  struct Found {
    int input = -1;
    std::size_t edge = 0;
    double ratio = 1.0;  // residual sum of squares, two models to one
    double rss = 0.0;    // of one model
    int rank = 0;
    int rank_left = 0;
    int rank_right = 0;
    double rows = 0.0;
    double tested = 0.0;
  };

  std::vector<double> edges_of_first_rows(Eigen::Index input) const;
  void lay_out(const Basis& basis);
  void set_edges(Bins& bins, std::vector<double> edges) const;
  void put(const StreamRow& row, const RowProducts& products);
  Sums side(const Bins& bins, std::size_t begin, std::size_t end) const;
  Found look_at(int input);
  bool passes(const Found& found) const;
  StreamSplit split_at(const Found& found, const Eigen::VectorXd& low, const Eigen::VectorXd& high) const;

  const StreamSetting& setting_;
  ResidualSums residuals_;
  std::vector<double> first_rows_;  // inputs, output, weight
  bool laid_out_ = false;
  std::vector<Bins> bins_;            // per input
  std::vector<double*> sums_of_row_;  // of put()
  Eigen::Index rows_ = 0;
  Eigen::Index next_test_ = 0;
  Eigen::Index first_passed_ = 0;
  int tests_ = 0;
  double different_ = 1.0;  // see StreamRow
};

}  // namespace llmt
