/// \file
/// Splits on inputs in which the prediction is to be monotone ("ordered splits"), and what a partition with such splits
/// must look like before it is estimated. See docs/algorithms/constraints.md.
#pragma once

#include <Eigen/Core>

#include "data/dataset.hpp"

namespace llmt {

/// The sign of the monotone input that a node splits; 0 if it splits another input or none.
int ordered_sign(const Node& node, const TrainingRows& training);

/// Whether some split is on an input in which the prediction is to be monotone.
bool has_ordered_splits(const Partition& partition, const TrainingRows& training);

/// Half width of a node's transition as it is evaluated: 0 if its inverse is not finite.
double half_width_of(const Node& node);

/// Values of each input between which each node may have validity, inputs x nodes; infinite where open.
struct Supports {
  Eigen::MatrixXd low;
  Eigen::MatrixXd high;
};
Supports supports_of(const Partition& partition, Eigen::Index inputs);

/// Limits half widths on monotone inputs, so that no transition leaves the range in which slopes count.
void limit_half_widths(Partition& partition, const TrainingRows& training);

/// Simplifies the guards and the treatment of missing values of a tree with ordered splits, so that OrderedSplits can
/// describe the prediction exactly. The slope of a leaf in a monotone input counts wherever the leaf has validity,
/// within the range of all rows. A missing value of another input counts as the mean of that input, or as its most
/// frequent level, at every split and in every local model. The training rows have no missing values.
void prepare_ordered_splits(Partition& partition, const TrainingRows& training);

}  // namespace llmt
