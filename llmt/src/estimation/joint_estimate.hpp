/// \file
/// Estimates of all local models of a partition at once.
#pragma once

#include <vector>

#include "estimation/joint_equations.hpp"
#include "estimation/sums/leaf_sums.hpp"
#include "llmt/progress.hpp"

namespace llmt {

/// The joint estimates (E.3) of the prefix with `leaves` leaves, one for each regularisation, in order:
///   minimise  sum_n q_n (y_n - sum_i Phi_i(x_n) a_n' w_i)^2
///             + sum_i (w_i - w_i^local)' (ridge x G_i + H_i) (w_i - w_i^local).
/// Ridge 0 is global estimation, a large ridge local estimation (Nelles 2001, 13.2). Sparse estimates have the
/// coefficients that were selected for each node; joint estimation does not select anew.
std::vector<Partition> joint(const LeafSums& sums, Eigen::Index leaves,
                             const std::vector<Regularisation>& regularisations);

/// A joint estimate on the rows `all`, of which the rows of `sample` are a sample that stands for them: from the
/// estimate on the sample by conjugate gradients, preconditioned with the factor of the sample's matrix. Local
/// estimates and regularisation are those of the sample. `work`: reports on the way, and may stop it.
Partition joint_from_sample(const LeafSums& sample, const TrainingRows& all, Eigen::Index leaves,
                            const Regularisation& regularisation, Work& work);

}  // namespace llmt
