// Estimates of an answer that stands, from all rows.
#pragma once

#include "discovery/terms/one_search.hpp"

namespace llmt::discovery {

/// What was found, fitted again on the rows searched and those set aside together: coefficients, constants, parameters,
/// their standard errors, Missing::before and corrected. The answer, what is confirmed and the errors on the rows set
/// aside stay those of the search. Outliers and rows apart are left out.
void fit_on_all_rows(const Simulation& simulation, const Recording& recording, const MeasuredOutputs& measured,
                     const std::vector<ModelTerm>& terms, const SearchedRows& rows, const MissingOptions& options,
                     Missing& missing);

}  // namespace llmt::discovery
