/// \file
/// A readable tree beside the model of a fit, in words and as JSON.
#pragma once

#include "llmt/fit.hpp"
#include "llmt/readable.hpp"
#include "report/document/document.hpp"

namespace llmt::report {

/// The tree that is taken, the steps of the path, and in `sentences` what readable_words() says of the choice. `asked`:
/// as of fit_readable().
Json readable_json(const FitResult& fitted, const ReadableResult& readable, const ReadableOptions& asked);

/// What the model, the readable tree and least squares cost, in size and in held-out error; the steps of the path, one
/// line each.
Section readable_words(const FitResult& fitted, const ReadableResult& readable, const ReadableOptions& asked);

}  // namespace llmt::report
