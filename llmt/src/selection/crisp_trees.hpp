/// \file
/// Held-out errors of one linear model and of crisp trees of every size.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/progress.hpp"
#include "selection/fold_errors.hpp"

namespace llmt {

/// Fills in Selection::linear and crisp_rmse, and as best_of_kind least squares, the ridge regression if it predicts
/// better, and the best crisp tree; `chosen` is the best of these. `weights`: of the outputs' squared errors.
void compare_crisp(const std::vector<FoldRows>& folds, const std::vector<GrownTree>& grown,
                   const Candidates& candidates, const Eigen::VectorXd& weights, int max_threads,
                   const FoldErrors& error_of_folds, Work& work, Selection& selection);

}  // namespace llmt
