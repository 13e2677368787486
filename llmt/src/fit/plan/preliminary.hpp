/// \file
/// Trees that are fitted before the fit, to see how far rows lie from them.
#pragma once

#include "llmt/options.hpp"

namespace llmt {

/// Options of a crisp tree of the rule RD with linear local models, on the same data, inputs and weights, and with the
/// same leaf sizes and folds as `options`. It is cheap, and its leaves tell where residuals are large.
FitOptions preliminary_options(const FitOptions& options);

}  // namespace llmt
