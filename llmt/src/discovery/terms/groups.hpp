// Terms that are the same function on these rows.
#pragma once

#include <vector>

#include "discovery/terms/term_model.hpp"
#include "llmt/discovery/missing.hpp"

namespace llmt::discovery {

/// For each term found that is a cause, the other terms of the library that explain as much in its place: beside
/// everything else that was fitted, they leave squares S' for S with
///
///     phi N / 2 ln(S'/S) + (k' - k) / 2 ln(phi N) <= 3,
///
/// k and k' the numbers fitted in each; but not those of more numbers that are within a fiftieth the same, which
/// contain it. The eight likeliest become its rivals; those that are already are not repeated. Where one differs from
/// it by more than a tenth of what it adds, rows cannot tell which function it is: the term is tentative, and a
/// sentence says where the two differ most.
void name_groups(const TermModel& model, const TermData& data, const TermFit& fit, Missing& missing);

}  // namespace llmt::discovery
