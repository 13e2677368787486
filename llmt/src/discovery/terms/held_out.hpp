// What the samples set aside say of the terms found.
#pragma once

#include "discovery/terms/input_noise.hpp"
#include "discovery/terms/missing_findings.hpp"

namespace llmt::discovery {

/// Sets FoundTerm::shrinks_gap and Missing::failing_rows. Errors are sums of squares over the samples set aside, in
/// units of the scatter of each output. A term is judged against a fit without it, to the samples searched, if it
/// changes the samples set aside by more than their noise hides. `baseline`: the fit without terms; `kept`: samples
/// searched, without outliers. What errors of the inputs add to terms of a state is taken off, if `errors` is given.
void judge_held_out(const TermModel& model, const TermData& kept, const TermData& aside, const TermFit& baseline,
                    const Settled& settled, const InputNoise* errors, Missing& missing);

/// For rows in time. Sets FoundTerm::hangs_on: terms are fitted once more without the samples at which a speed, that
/// the term is no function of alone, is among its smallest 15 %. A term hangs on that speed if its first coefficient
/// falls to less than a half, by more than 4 standard errors. And sets FoundTerm::inner_state of terms whose input is a
/// derivative of the output by time.
void judge_in_time(const TermModel& model, const TermData& kept, const Inputs& inputs, const MeasuredOutputs& measured,
                   const Settled& settled, Missing& missing);

}  // namespace llmt::discovery
