/// \file
/// Linear or quadratic local models: which of the two has the smaller held-out error.
#pragma once

#include "llmt/fit.hpp"

namespace llmt {

/// fit() for LocalTerms::automatic: both fits, and the better one. Linear without folds, and where quadratic local
/// models cannot be made. `work` and `loss_weights`: as fit_terms().
FitResult fit_linear_or_quadratic(const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                                  const Eigen::Ref<const Eigen::MatrixXd>& outputs, const FitOptions& options,
                                  Work& work, const Eigen::VectorXd& loss_weights = {});

}  // namespace llmt
