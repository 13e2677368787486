/// \file
/// The last step of every estimate: local models under signs of slopes and ordered splits.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "base/matrix.hpp"
#include "constraints/constrained_leaves.hpp"
#include "estimation/sums/leaf_sums.hpp"

namespace llmt {

/// An estimate of all leaves of a prefix, before the constraints.
struct FreeEstimate {
  std::vector<Eigen::MatrixXd> models;  ///< coefficients of every node; those of the leaves are replaced
  Eigen::MatrixXd leaf_coefficients;    ///< one leaf below the other in the order of their nodes
  RowMajor factor;                      ///< upper Cholesky factor of the matrix of `leaf_coefficients`
  bool sparse = false;                  ///< no constraints then
};

/// The prefix with the estimate that is nearest to `free` under the constraints, see constrain_leaves(). `leaf_nodes`:
/// of the prefix, ascending. `active`: inequalities to start from, of the same prefix; afterwards those that are
/// active.
Partition constrained(const LeafSums& sums, const std::vector<int>& leaf_nodes, const FreeEstimate& free,
                      ActiveInequalities& active);

/// The prefix with `leaves` leaves that were each estimated for themselves, under the constraints. `models`: of every
/// node, with the signs. `shrinkage`: of the estimate.
Partition constrained_one_by_one(const LeafSums& sums, Eigen::Index leaves, const std::vector<Eigen::MatrixXd>& models,
                                 double shrinkage);

}  // namespace llmt
