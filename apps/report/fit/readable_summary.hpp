/// \file
/// A readable tree beside the model of a fit, as text and as JSON.
#pragma once

#include <string>

#include "llmt/fit.hpp"
#include "llmt/readable.hpp"
#include "report/text/json.hpp"
#include "report/text/text.hpp"

namespace llmt::report {

Json readable_json(const ReadableResult& readable);

/// What the model, the readable tree and least squares cost, in size and in held-out error. `loss`: as of
/// fit_readable(); `width`: of the table.
std::string readable_text(const FitResult& fitted, const ReadableResult& readable, double loss,
                          std::size_t width = no_width_limit);

}  // namespace llmt::report
