/// \file
/// The stages of a fit, one after the other.
#pragma once

#include "fit/prepared_rows.hpp"
#include "llmt/fit_result.hpp"

namespace llmt {

/// Chooses terms and inputs, grows, chooses and finishes. `work`: of this. Throws as fit().
FitResult fit(const PreparedRows& rows, Work& work);

}  // namespace llmt
