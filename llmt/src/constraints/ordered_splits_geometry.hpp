/// \file
/// Where the leaves of a partition reach, and their guarded local models: what ordered splits are made from.
#pragma once

#include <vector>

#include "constraints/ordered_splits.hpp"

namespace llmt {

class OrderedSplits::Geometry {
 public:
  Geometry(const Partition& partition, const TrainingRows& training, Eigen::Index output);

  const Node& node(int index) const { return partition_.nodes[index]; }
  int inputs() const { return static_cast<int>(std::ssize(training_.columns)); }

  /// Of the monotone input that a node splits; 0: none.
  int sign(int node) const { return signs_[node]; }
  double half_width(int node) const;

  bool is_categorical(int input) const { return levels(input) > 0; }
  int levels(int input) const { return training_.table->num_levels[input]; }
  const std::vector<Eigen::Index>& regressors_of(int input) const { return regressors_[input]; }
  Eigen::Index regressor_of(int input) const {
    return regressors_of(input).empty() ? -1 : regressors_of(input).front();
  }
  double centre(Eigen::Index regressor) const { return training_.regressors[regressor].centre; }
  int level_of(Eigen::Index regressor) const { return training_.regressors[regressor].level; }

  /// Values of a numeric input between which a node may have validity; open ends.
  double low(int input, int node) const { return low_(input, node); }
  double high(int input, int node) const { return high_(input, node); }
  /// Whether a row with this level, or without a value, of an input may reach a node.
  bool reaches(int node, int input, int level) const {
    const std::vector<char>& reached = levels_[input][node];
    return reached[level] != 0;
  }
  bool reaches_missing(int node, int input) const { return missing_(input, node) != 0; }

  /// Whether two leaves count at the same point for some value of each input, but for one input.
  bool meet(int left, int right, int but) const;

  /// One over the number of splits above a leaf whose transitions on the input reach into from ... to.
  double share(int leaf, int input, double from, double to) const;

  /// A leaf's part of one regressor at a deviation.
  Held held(int leaf, Eigen::Index regressor, double deviation) const;

  /// Adds the deviations between low and high where this function has another formula before than behind.
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

/// Half width of a node's transition as it is evaluated: 0 where one over it is not finite.
double half_width_of(const Node& node);

/// Sign of the monotone input that a node splits; 0: none.
int ordered_sign(const Node& node, const TrainingRows& training);

/// Values of each input between which each node may have validity, inputs x nodes; infinite where open.
struct Supports {
  Eigen::MatrixXd low;
  Eigen::MatrixXd high;
};
Supports supports_of(const Partition& partition, Eigen::Index inputs);

}  // namespace llmt
