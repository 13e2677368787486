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

/// For rows in time. Sets FoundTerm::inner_state of terms whose input is a derivative of the output by time: they stand
/// for a state.
void find_states_of_outputs(const Recording& recording, const MeasuredOutputs& measured, Missing& missing);

}  // namespace llmt::discovery
