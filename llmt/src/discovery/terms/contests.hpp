// Answers among other terms, and which of two answers stands.
#pragma once

#include <functional>
#include <set>
#include <vector>

#include "discovery/terms/cross_validation.hpp"

namespace llmt::discovery {

/// Whether something is left that no term without a regime explains: more than twice the noise, as far as that is
/// known, and the answer says so, or what is left is alike in neighbouring rows.
bool leaves_something(const Missing& missing);

/// The indices of terms that act in a regime alone.
std::set<std::size_t> terms_of_regimes(const std::vector<ModelTerm>& terms);

/// Of two answers, the one that explains stretches best that no fit has used. `ratio`: log_likelihood_ratio(). Where it
/// is within the margin, rows cannot tell them apart: the one of fewer numbers has the name, the other is its rival,
/// and it is tentative unless both are the same function there. One that is certain is replaced by a certain one alone.
Missing better_of(Missing found, Missing other, double ratio);

/// Runs every contest that applies, in the order of a table: what was found against the answer of a search among other
/// terms. `search`: of the terms given, but for those in the set. `refuted`: terms that are no candidates.
Missing contested(Missing found, const std::vector<ModelTerm>& terms, const std::set<std::size_t>& refuted,
                  const CrossValidation& validation,
                  const std::function<Missing(const std::vector<ModelTerm>&, const std::set<std::size_t>&)>& search);

}  // namespace llmt::discovery
