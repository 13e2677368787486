/// \file
/// What a fit learns from, made ready once.
#pragma once

#include "fit/prepared_rows.hpp"

namespace llmt {

/// Checks the options and the rows, finds the equal rows, weights all by the loss, chooses codes, deals folds, and
/// describes the columns. The matrices must outlive the result. `work`: this counts as a part of it. Throws as fit().
PreparedRows prepare(const GivenRows& all, const FitOptions& options, Work& work);

}  // namespace llmt
