/// \file
/// Estimates of all leaves of a partition under signs of slopes and ordered splits.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "base/matrix.hpp"
#include "constraints/ordered_splits.hpp"
#include "data/dataset.hpp"

namespace llmt {

/// Of each output.
using ActiveInequalities = std::vector<std::vector<LeafInequality>>;

/// Changes the coefficients of the leaves, one below the other, each column an output, as little as possible so that
/// all constraints hold: the w nearest in the norm |factor (w - coefficients)|, `factor` the upper Cholesky factor of
/// the estimate's matrix, which is the constrained estimate. Inequalities of ordered splits are added as they are found
/// to be violated (cutting planes). `active`: inequalities to begin with, of the same partition; then those that hold.
///
/// Coefficients are those of columns divided by training.scale, about the root's model `root`. `partition`: inner nodes
/// final; `leaves`: its leaves' nodes in the order of the coefficients.
void constrain_leaves(const Partition& partition, const TrainingRows& training, const std::vector<int>& leaves,
                      const RowMajor& factor, const Eigen::MatrixXd& root, Eigen::MatrixXd& coefficients,
                      ActiveInequalities& active);

/// The last step of every constrained estimate, on the numbers that a model is made of: slopes that have the wrong sign
/// by rounding become 0, and leaves on either side of ordered splits are moved apart where they have less than the
/// least room, by rounding or because the cutting planes were given up.
void finish_constrained(Partition& partition, const TrainingRows& training);

/// The room that ordered splits of a finished partition leave, see OrderedSplits::room(); infinity without them. The
/// smallest over the outputs.
double order_room(const Partition& partition, const TrainingRows& training);

}  // namespace llmt
