/// \file
/// Which effect is missing from a simulation: residuals, the baseline's Jacobian and the signatures of candidate
/// effects go in, a verdict comes out. Nothing here knows what the simulation is of.
///
///     const llmt::discovery::Evidence evidence{.residuals = residuals, .jacobian = jacobian, .components = 3};
///     const llmt::discovery::EffectCandidate heat{.family = "heat", .location = "link1", .signature = signature};
///     const llmt::discovery::Verdict verdict = llmt::discovery::search(evidence, {heat});
#pragma once

#include <string>
#include <vector>

#include "llmt/discovery/verdict.hpp"

namespace llmt::discovery {

/// Searches for the set of candidates that explains the residuals, in this order:
///
/// 1. What the baseline can imitate, the range of its Jacobian, is projected out of residuals and signatures.
/// 2. Sets A of candidates are scored by
///      N ln(RSS_A / (N - k_A)) + k_A ln N + 2 sum_f (ln n_fam + ln binomial(n_loc(f), n_used(f))),
///    N = n d - rank, the sum over the families f in A. This is Schwarz's criterion plus the logarithm of the number of
///    sets of the same kind. Values must lie within their limits, up to two standard errors. The search adds, drops and
///    swaps candidates; it starts from the empty set, from the best single candidates of different families, and from
///    whole families.
/// 3. A sample is an outlier if leaving it out lowers the score by more than a free shift of its mean costs.
/// 4. The gain over no explanation must exceed what the best single candidate gains by chance (max-T): in normally
///    distributed noise, and in the residuals with random signs, both projected in the same way.
/// 5. Where another family in the place of one predicts the same at every sample, the less complex one gets the name.
///    Generic candidates stay only where no set of causes comes within `rival_margin`.
/// 6. A family is dropped if the exact leave-one-sample-out error is smaller without it, or its share is immaterial.
/// 7. For each family, the other families that explain as well in its place are listed.
/// 8. Findings are confirmed unless generic candidates explain a material share, or more is left than repeats scatter.
///
/// Deterministic. Throws std::invalid_argument for wrong shapes, values that are not finite, and no samples.
Verdict search(const Evidence& evidence, const std::vector<EffectCandidate>& candidates,
               const SearchOptions& options = {});

/// "nothing missing", "named", "named, indistinguishable", "unknown effect", "failed on held-out rows",
/// "parameters only", "an inner state".
std::string to_string(Answer answer);

}  // namespace llmt::discovery
