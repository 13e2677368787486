// What the samples set aside say of the terms found.
#pragma once

#include "discovery/terms/missing_findings.hpp"

namespace llmt::discovery {

/// Sets FoundTerm::shrinks_gap and Missing::failing_rows. Errors are sums of squares over the samples set aside, in
/// units of the scatter of each output. A term is judged against a fit without it, to the samples searched, if it
/// changes the samples set aside by more than their noise hides. `baseline`: the fit without terms; `kept`: samples
/// searched, without outliers.
void judge_held_out(const TermModel& model, const TermData& kept, const TermData& held_out, const TermFit& baseline,
                    const Settled& settled, Missing& missing);

}  // namespace llmt::discovery
