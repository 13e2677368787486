/// \file
/// A fit whose local models have given terms.
#pragma once

#include "llmt/fit.hpp"

namespace llmt {

/// fit() for LocalTerms::linear or quadratic, of checked options.
FitResult fit_terms(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
                    const FitOptions& options);

}  // namespace llmt
