/// \file
/// A small tree on residuals while it grows, and its leaves' models.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <vector>

#include "base/parallel.hpp"
#include "boosted/binned_rows.hpp"
#include "boosted/leaf_model.hpp"
#include "boosted/packed_sums.hpp"
#include "boosted/split_gain.hpp"
#include "llmt/random.hpp"

namespace llmt {

struct TreeOptions {
  bool symmetric = true;  ///< one split for all leaves of a level; else the best leaf is split
  int depth = 6;          ///< of a symmetric tree
  int leaves = 64;        ///< of a free tree
  int slopes = 3;         ///< in a leaf, at most
  Ridges ridges = {};
  double softness = 0.0;  ///< half width of a transition by the distance to the node's border; 0: crisp
  double columns = 0.5;   ///< share of the features that a level, or a leaf of a free tree, looks at
  double fewest = 1.0;    ///< rows on either side of a split of a free tree
  /// Of more rows the splits of a crisp symmetric tree are found on a part of so many at most, another one for each
  /// tree. Leaves are estimated on all rows.
  Eigen::Index searched = std::numeric_limits<Eigen::Index>::max();
};

/// The features that have slopes, without memory of their own: nodes are made and copied by the thousand.
class SlopeFeatures {
 public:
  std::size_t size() const { return size_; }
  void push_back(int feature) { features_[size_++] = feature; }
  int operator[](std::size_t k) const { return features_[k]; }
  const int* begin() const { return features_.data(); }
  const int* end() const { return features_.data() + size_; }

 private:
  std::array<int, most_boosted_slopes> features_ = {};
  std::size_t size_ = 0;
};

/// The model of a node: what the splits on the way to it added.
struct PathModel : LeafModel {
  SlopeFeatures features = {};
  Slopes means = {};  ///< as BoostedLeaf

  double at(const BinnedRows& rows, Eigen::Index row) const {
    double value = constant;
    for (std::size_t k = 0; k < features.size(); ++k) {
      const BinnedFeature& feature = rows.features[features[k]];
      value += slopes[k] * (feature.cells[row] == missing_cell ? means[k] : static_cast<double>(feature.values[row]));
    }
    return value;
  }
};

struct GrowingNode {
  int feature = -1;           ///< -1: a leaf
  int cell = 0;               ///< the last one of the left side
  double missing_left = 0.0;  ///< as BoostedSplit
  double half_width = 0.0;
  int left = -1;
  int right = -1;
  int parent = -1;
  Eigen::Index begin = 0;  ///< of its rows among the grower's
  Eigen::Index end = 0;
  PathModel model = {};

  Eigen::Index count() const { return end - begin; }
};

using GrowingTree = std::vector<GrowingNode>;

/// A split of the rows of some leaves.
struct SplitChoice {
  static constexpr double undecided = 0.5;

  double gain = 0.0;
  int feature = -1;                 ///< -1: none gains
  int cell = 0;                     ///< the last one of the left side
  double missing_left = undecided;  ///< 0 or 1 where rows lack the feature, else undecided

  void take_if_better(const SplitChoice& other) {
    if (other.gain > gain) *this = other;
  }
};

/// What the thresholds of a feature gain in some leaves, with missing values on either side.
class FeatureGains {
 public:
  FeatureGains() = default;
  FeatureGains(const BinnedRows& rows, int feature);

  /// Adds those of a leaf, see add_gains().
  void add(const Histogram& histogram, const PackedUnits& units, const Ridges& ridges, bool slopes);
  SplitChoice best() const;

 private:
  int feature_ = -1;
  const BinnedFeature* column_ = nullptr;
  bool has_missing_ = false;    // in one of the leaves
  std::array<Gains, 2> gains_;  // the second one with missing values on the left
};

/// The best of the choices `best_of(some)` among at most `features_at_once` features each.
template <class BestOf>
SplitChoice best_of_all(std::span<const int> features, int max_threads, const BestOf& best_of) {
  std::vector<SplitChoice> of_some((features.size() + features_at_once - 1) / features_at_once);
  parallel_for(std::ssize(of_some), max_threads, [&](Eigen::Index k) {
    const std::size_t first = k * features_at_once;
    of_some[k] = best_of(features.subspan(first, std::min(features_at_once, features.size() - first)));
  });
  SplitChoice best;
  for (const SplitChoice& one : of_some) best.take_if_better(one);
  return best;
}

/// Of each feature, whether some of the first `count` rows lack it.
std::vector<bool> lacked_features(const BinnedRows& rows, Eigen::Index count);

/// The means of the features that have slopes in the leaf's rows, 0 of those that rows of the fit lack: BoostedLeaf.
Slopes means_of(const RegressorSums& sums, const SlopeFeatures& features, const std::vector<bool>& lacked);

/// The features that a level, or a leaf of a free tree, looks at, in ascending order.
std::vector<int> some_features(std::size_t all, double share, Random& random);

/// A tree's prediction for a row of the fit.
double value_at(const GrowingTree& tree, const BinnedRows& rows, Eigen::Index row);

BoostedTree finished(const GrowingTree& tree, const BinnedRows& rows);

/// Grows trees on the first `count` rows, or estimates the leaves of one that is there.
class TreeGrower {
 public:
  TreeGrower(const BinnedRows& rows, Eigen::Index count, TreeOptions options, int max_threads);

  /// `residuals`: one for each row of the fit.
  GrowingTree grow(const Eigen::VectorXd& residuals, Random& random);

  /// The tree with its splits, and leaves from these rows.
  GrowingTree estimate(const GrowingTree& tree, const Eigen::VectorXd& residuals);

  /// residuals -= rate . tree in all rows. `tree`: the last one of grow() or estimate().
  void subtract_last(const GrowingTree& tree, double rate, Eigen::VectorXd& residuals) const;

 private:
  struct RowsInLeaf {
    std::span<const int> rows;
    std::span<const double> shares;  // empty: all 1
  };
  struct SoftRows {
    std::vector<int> rows;  // the first `count`; there may be room for more
    std::vector<double> shares;
    std::size_t count = 0;

    void make_room(std::size_t most) {
      if (rows.size() >= most) return;
      rows.resize(most);
      shares.resize(most);
    }
    std::span<const int> of_rows() const { return std::span(rows).first(count); }
    std::span<const double> of_shares() const { return std::span(shares).first(count); }
  };

  void begin(const Eigen::VectorXd& residuals);
  void pack(const GrowingNode& node);
  SplitChoice best_of_features(std::span<const int> leaves, std::span<const int> features) const;
  SplitChoice best_split(std::span<const int> leaves, Random& random) const;
  SplitChoice refined(std::span<const int> leaves, SplitChoice choice);
  void gather(const GrowingNode& node, int feature);
  RowsInOrder rows_of(const GrowingNode& node) const;
  bool may_have_slope(const GrowingNode& node, int feature) const;
  void split(std::span<const int> leaves, std::span<const SplitChoice> choices);
  void split_rows(int node);
  double weight_of(const GrowingNode& node) const;
  void add_to_path(GrowingNode& side, int feature);
  double half_width_of(int node) const;
  bool blends_well(int node, double half_width) const;
  void grow_symmetric(Random& random);
  void grow_free(Random& random);
  void fit_leaves(const Eigen::VectorXd& residuals);
  void share_rows();
  void share_rows_of(int node);
  void fit_leaf(GrowingNode& leaf, std::span<const int> rows, std::span<const double> shares,
                const Eigen::VectorXd& residuals) const;
  RowsInLeaf rows_in(const GrowingTree& tree, int leaf) const;
  void hold_empty(GrowingNode& leaf, const Eigen::VectorXd& residuals) const;

  const BinnedRows& rows_;
  const Eigen::Index count_;
  const TreeOptions options_;
  const int max_threads_;
  const std::vector<bool> lacked_;  // of each feature, by rows that are learned from
  GrowingTree tree_;
  std::vector<int> order_;         // the rows, those of a node together
  std::vector<double> residuals_;  // of the node's own model, in that order
  std::vector<double> weights_;    // in that order
  std::vector<PackedSum> terms_;   // in that order, while splits are searched
  bool is_searching_ = true;
  std::vector<float> values_;  // of the feature that is split, in that order
  std::vector<int> cells_;     // of that feature, before rows are divided; missing values at the end of their side
  bool is_gathered_ = false;   // whether cells_ and values_ have the next split's
  std::vector<int> spare_order_;
  std::vector<float> spare_values_;
  std::vector<double> spare_residuals_;
  std::vector<double> spare_weights_;
  PackedUnits units_;                // of the terms of a tree
  std::vector<SoftRows> soft_rows_;  // of each node, if the tree is soft
  bool is_soft_ = false;
};

}  // namespace llmt
