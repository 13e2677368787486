/// \file
/// A fit whose local models have given terms.
#pragma once

#include <functional>

#include "llmt/fit.hpp"

namespace llmt {

/// fit() for LocalTerms::linear or quadratic, of checked options. `loss_weights`: positive, one for each row of
/// positive weight; in training, not in errors, a row's weight is times this. Empty: all 1. `watch`: what Work reports
/// of each partition, for tests.
FitResult fit_terms(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
                    const FitOptions& options, const Eigen::VectorXd& loss_weights = {},
                    const std::function<void(double share, double operations)>& watch = {});

}  // namespace llmt
