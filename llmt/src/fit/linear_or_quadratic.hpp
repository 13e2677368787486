/// \file
/// Linear or quadratic local models: what the held-out rows say.
#pragma once

#include "llmt/fit.hpp"

namespace llmt {

/// Numeric regression inputs among so many inputs.
Eigen::Index count_numbers(Eigen::Index inputs, const FitOptions& options);

/// fit() with LocalTerms::automatic: both fits, and the one to take.
FitResult fit_best_terms(const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                         const Eigen::Ref<const Eigen::MatrixXd>& outputs, const FitOptions& options);

}  // namespace llmt
