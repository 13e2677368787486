/// \file
/// Linear or quadratic local models: which of the two has the smaller held-out error.
#pragma once

#include <utility>
#include <vector>

#include "fit/prepared_rows.hpp"
#include "llmt/fit_result.hpp"

namespace llmt {

/// The terms to fit with, and for each its share of the work: those asked for, or for LocalTerms::automatic linear and
/// then quadratic ones. Linear alone without folds, and where quadratic local models cannot be made.
std::vector<std::pair<LocalTerms, double>> terms_to_compare(const PreparedRows& rows);

/// The one of two fits whose error on held-out rows is smaller, with the errors of the other in
/// FitSummary::other_terms. Where all linear models are least squares, quadratic ones have to be better beyond chance.
/// A single fit is itself.
FitResult better_of(std::vector<FitResult> fits);

}  // namespace llmt
