// The question to search() at the present estimates, and rounds of search and fit.
#pragma once

#include <map>
#include <vector>

#include "discovery/answer/errors_of_inputs.hpp"
#include "discovery/answer/term_fit.hpp"
#include "llmt/discovery/search.hpp"
#include "llmt/progress.hpp"

namespace llmt::discovery {

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
/// was moved. `kept`: without outliers. Samples between a threshold and where it should be look like outliers, so a
/// threshold is placed on all samples, `data`.
bool retry_constants(const TermModel& model, const TermData& kept, const TermData& data, TermFit& fit);

/// Sets the errors of constants that are not smooth, see trial_error().
void set_trial_errors(const TermModel& model, const TermData& data, TermFit& fit);

/// The end of the rounds of search and fit.
struct Settled {
  TermFit fit;
  Verdict verdict;
  TermQuestion question;
  int rounds = 0;
};

/// Root mean square of what is left of each output, in its own unit; 1 where nothing is left.
Eigen::VectorXd scatter(const TermModel& model, const TermData& data, const TermFit& fit);

/// Searches and fits until the found set stays the same: first the terms of rows by themselves, then beside them those
/// that depend on earlier rows, which stay if they explain better by the rivals' margin. The weights of the outputs in
/// `data`, those of the samples, and the share of the samples that is independent, follow what each round leaves.
Settled search_terms(const TermModel& model, TermData& data, const std::vector<Eigen::Index>& repeats,
                     const TermFit& baseline, const KnownErrors& errors, const MissingOptions& options, Work& work);

}  // namespace llmt::discovery
