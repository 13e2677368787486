/// \file
/// Crisp symmetric trees: all leaves of a level have one split. The rows stay where they are, so that every pass reads
/// and writes memory in its order; a leaf is a number beside the row.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "boosted/growing_tree.hpp"
#include "boosted/refine_split.hpp"

namespace llmt {

/// The largest TreeOptions::depth, and the leaves of such a tree.
inline constexpr int most_symmetric_depth = 6;
inline constexpr int most_symmetric_leaves = 1 << most_symmetric_depth;

/// Grows trees on the first `count` rows, or estimates the leaves of one that is there; as TreeGrower, which takes all
/// other trees.
class SymmetricGrower {
 public:
  SymmetricGrower(const BinnedRows& rows, Eigen::Index count, TreeOptions options, int max_threads);

  /// `residuals`: one for each row of the fit.
  GrowingTree grow(const Eigen::VectorXd& residuals, Random& random);

  /// The tree with its splits, and leaves from these rows.
  GrowingTree estimate(const GrowingTree& tree, const Eigen::VectorXd& residuals);

  /// residuals -= rate . tree in all rows. `tree`: the last one of grow() or estimate().
  void subtract_last(const GrowingTree& tree, double rate, Eigen::VectorXd& residuals) const;

 private:
  void begin(const Eigen::VectorXd& residuals, bool is_searching);
  bool may_have_slope(int feature) const;
  SplitChoice best_of_features(std::span<const int> features) const;
  void split(SplitChoice choice, bool is_refined, bool is_last);
  void move_rows(const SplitChoice& level, std::span<const SideModel> sides, bool is_packed);
  void fit_leaves(const Eigen::VectorXd& residuals);
  void leaves_of_rows(Eigen::Index first, std::span<std::uint8_t> leaves) const;
  GrowingTree tree() const;
  int add_node(GrowingTree& tree, std::size_t level, std::size_t first) const;

  const BinnedRows& rows_;
  const Eigen::Index count_;
  const TreeOptions options_;
  const int max_threads_;
  const std::vector<bool> lacked_;  // of each feature, by rows that are learned from
  const std::vector<int> lacking_;  // held-out rows that lack another one
  // The tree that grows.
  struct Level {
    SplitChoice split;
    std::vector<double> left;  // of the nodes: GrowingNode::missing_left
  };
  std::vector<Level> levels_;
  SlopeFeatures features_;         // with slopes, which all leaves have
  std::vector<LeafModel> models_;  // of the paths, then of the leaves
  std::vector<Slopes> means_;      // of the leaves
  std::vector<bool> has_rows_;     // each of them
  // The rows that are searched for splits, a part of all.
  Eigen::Index first_ = 0;
  std::vector<std::uint8_t> leaves_;
  std::vector<double> residuals_;  // of the path's model
  std::vector<PackedSum> terms_;
  PackedUnits units_;
  Eigen::Index trees_ = 0;  // grown so far
};

}  // namespace llmt
