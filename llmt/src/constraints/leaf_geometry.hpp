/// \file
/// Where the leaves of a partition have validity, and their guarded local models: what the conditions between leaves
/// are made from.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "base/count.hpp"
#include "data/dataset.hpp"

namespace llmt {

/// A leaf's guarded part of one regressor, eq. (B.2) of docs/algorithms/guards.md, as a function of the leaf's own
/// slope: slope x deviation + rest.
struct ClampedDeviation {
  double deviation = 0.0;  ///< clamped to the range of the leaf
  double rest = 0.0;       ///< what the slopes of the ancestors add beyond it
};

/// The geometry of a partition for one output. Partition and rows must live as long as this.
class LeafGeometry {
 public:
  LeafGeometry(const Partition& partition, const TrainingRows& training, Eigen::Index output);

  const Node& node(int index) const { return partition_.nodes[index]; }
  int inputs() const { return count_of(training_.columns); }

  /// The sign of the monotone input that a node splits; 0 if there is none.
  int sign(int node) const { return signs_[node]; }
  double half_width(int node) const;

  bool is_categorical(int input) const { return levels(input) > 0; }
  int levels(int input) const { return training_.table->num_levels[input]; }
  const std::vector<Eigen::Index>& regressors_of(int input) const { return regressors_[input]; }
  /// The first regressor of an input; -1 if it has none.
  Eigen::Index regressor_of(int input) const {
    return regressors_of(input).empty() ? -1 : regressors_of(input).front();
  }
  double centre(Eigen::Index regressor) const { return training_.regressors[regressor].centre; }
  int level_of(Eigen::Index regressor) const { return training_.regressors[regressor].level; }

  /// Values of a numeric input between which a node may have validity; open ends.
  double low(int input, int node) const { return low_(input, node); }
  double high(int input, int node) const { return high_(input, node); }
  /// Whether a row with this level of a categorical input may reach a node.
  bool reaches(int node, int input, int level) const { return levels_[input][node][level] != 0; }
  /// Whether a row without a value of an input may reach a node.
  bool reaches_missing(int node, int input) const { return missing_(input, node) != 0; }

  /// Whether there are values of all inputs but `except` at which both leaves have validity.
  bool meet(int left, int right, int except) const;

  /// s_i of eq. (O.1), the part of a leaf's slope that one split may use: one over the number of splits above the leaf
  /// whose transitions on the input overlap from ... to.
  double slope_share(int leaf, int input, double from, double to) const;

  /// A leaf's part of one regressor at a deviation, as LocalModels evaluates it.
  ClampedDeviation clamped(int leaf, Eigen::Index regressor, double deviation) const;

  /// Adds to `to` the deviations between low and high at which that function goes over from one parabola to the next.
  void add_kinks(int leaf, Eigen::Index regressor, double low, double high, std::vector<double>& to) const;

 private:
  void hand_down(int node);

  const Partition& partition_;
  const TrainingRows& training_;
  Eigen::Index output_;
  std::vector<int> parents_;
  std::vector<int> signs_;
  std::vector<std::vector<Eigen::Index>> regressors_;  // of each input
  Eigen::MatrixXd low_;                                // inputs x nodes
  Eigen::MatrixXd high_;
  Eigen::MatrixXi missing_;
  std::vector<std::vector<std::vector<char>>> levels_;  // of each input and node; empty for numbers
};

}  // namespace llmt
