/// \file
/// A fit whose local models have given terms.
#pragma once

#include <functional>

#include "llmt/fit.hpp"

namespace llmt {

/// fit() for LocalTerms::linear or quadratic, of checked options. `watch`: what Work reports of each partition, for
/// tests.
FitResult fit_terms(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
                    const FitOptions& options, const std::function<void(double share, double operations)>& watch = {});

}  // namespace llmt
