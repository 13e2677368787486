/// \file
/// A fit whose local models have given terms.
#pragma once

#include "llmt/fit.hpp"

namespace llmt {

/// fit() for LocalTerms::linear or quadratic, of checked options. `work`: of this fit; FitOptions::progress is not
/// used. `loss_weights`: positive, one for each row of positive weight; in training, not in errors, a row's weight is
/// times this. Empty: all 1.
FitResult fit_terms(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
                    const FitOptions& options, Work& work, const Eigen::VectorXd& loss_weights = {});

}  // namespace llmt
