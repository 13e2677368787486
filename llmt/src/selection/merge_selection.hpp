/// \file
/// How many local models are left when leaves are merged.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "selection/candidates.hpp"

namespace llmt {

/// Tries the chosen candidate, and the same with up to three times as many leaves, with ever fewer local models; takes
/// the smallest held-out error. In every fold the tree grown there is merged by its own training rows. Changes nothing
/// where no merge lowers the error.
void choose_local_models(const std::vector<FoldRows>& folds, const std::vector<GrownTree>& grown,
                         const Eigen::VectorXd& weights, int max_threads, Selection& selection);

}  // namespace llmt
