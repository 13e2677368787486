/// \file
/// Estimates of all leaves of a partition under signs of slopes and ordered splits.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "base/matrix.hpp"
#include "constraints/ordered_splits.hpp"
#include "data/dataset.hpp"

namespace llmt {

/// The active inequalities of each output.
using ActiveInequalities = std::vector<std::vector<LeafInequality>>;

/// Moves the coefficients of the leaves to the nearest ones under all constraints. Each column of `coefficients` is an
/// output and has one leaf below the other. The distance is |factor (w - coefficients)|, with `factor` the upper
/// Cholesky factor of the estimate's matrix; the nearest w is therefore the constrained estimate. Inequalities of
/// ordered splits are added as they are found to be violated (cutting planes). `active`: inequalities to start from, of
/// the same partition; afterwards those that are active.
///
/// Coefficients are those of columns divided by training.scale, less the root's model `root`. `partition`: inner nodes
/// final; `leaves`: its leaves' nodes in the order of the coefficients.
void constrain_leaves(const Partition& partition, const TrainingRows& training, const std::vector<int>& leaves,
                      const RowMajor& factor, const Eigen::MatrixXd& root, Eigen::MatrixXd& coefficients,
                      ActiveInequalities& active);

/// The last step of every constrained estimate, on the numbers that a model consists of. Slopes that have the wrong
/// sign by rounding become 0. Leaves on the two sides of an ordered split are moved apart if their margin is too small,
/// because of rounding or because the cutting planes were given up.
void finish_constrained(Partition& partition, const TrainingRows& training);

/// The smallest feasibility margin of the ordered splits of a finished partition, see OrderedSplits::smallest_margin().
/// The smallest over the outputs; infinity without ordered splits.
double order_margin(const Partition& partition, const TrainingRows& training);

}  // namespace llmt
