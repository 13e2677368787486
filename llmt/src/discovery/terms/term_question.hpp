// The question to search() at the present estimates.
#pragma once

#include <map>
#include <vector>

#include "discovery/terms/input_noise.hpp"
#include "discovery/terms/term_model.hpp"

namespace llmt::discovery {

TermData without_samples(const TermData& data, const std::vector<std::size_t>& left_out);

/// The residuals without term t of the fit, and everything else that may explain them.
TrialGround ground_without(const TermModel& model, const TermData& data, const TermFit& fit, std::size_t t);

struct TermQuestion {
  Evidence evidence;
  std::vector<PlacedTerm> options;  // one for each candidate
  std::vector<EffectCandidate> candidates;
};

/// The question at the present estimates. The found terms compete again, with what they explain added back to the
/// residuals. Constants of the other terms are tried on the residuals without the samples in `outliers`. Terms that
/// depend on earlier rows are candidates only `with_history`. `noise`: of the inputs, or none.
TermQuestion ask(const TermModel& model, const TermData& data, const TermFit& fit,
                 const std::vector<Eigen::Index>& repeats, const std::vector<std::size_t>& outliers, bool with_history,
                 const InputNoise* noise = nullptr);

/// Moves constants of terms to a better value, if there is one now that everything else is fitted. Returns whether any
/// was moved.
bool retry_constants(const TermModel& model, const TermData& data, TermFit& fit);

/// Sets the errors of constants that are not smooth, see trial_error().
void set_trial_errors(const TermModel& model, const TermData& data, TermFit& fit);

}  // namespace llmt::discovery
