/// \file
/// Estimates of the local models one by one: as grown, or locally weighted.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "estimation/sums/leaf_sums.hpp"

namespace llmt {

/// The prefix with `leaves` leaves and local models as grown; ranges are those of the validities.
Partition as_grown(const LeafSums& sums, Eigen::Index leaves);

/// The prefix with `leaves` leaves and the locally weighted estimates (E.1). `shrinkage`: in rows. `sparse`: with the
/// selected regressors alone; the root keeps its full model above leaves, because guards refer to it.
Partition local(const LeafSums& sums, Eigen::Index leaves, double shrinkage, bool sparse = false);

/// The coefficients of the locally weighted models of the first `nodes` nodes. The root's are zero, for it keeps its
/// model, unless it is the only node and sparse.
std::vector<Eigen::MatrixXd> local_models(const LeafSums& sums, std::size_t nodes, double shrinkage, bool sparse);

}  // namespace llmt
