/// \file
/// A readable tree beside the model of a fit, in words and as JSON.
#pragma once

#include "llmt/fit.hpp"
#include "llmt/readable.hpp"
#include "report/document/document.hpp"

namespace llmt::report {

Json readable_json(const ReadableResult& readable);

/// What the model, the readable tree and least squares cost, in size and in held-out error. `loss`: as of
/// fit_readable().
Section readable_words(const FitResult& fitted, const ReadableResult& readable, double loss);

}  // namespace llmt::report
