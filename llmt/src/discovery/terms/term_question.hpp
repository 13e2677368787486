// What search() is asked at the present estimates.
#pragma once

#include <map>
#include <vector>

#include "discovery/terms/term_model.hpp"

namespace llmt::discovery {

/// Rows that take part, and rows set aside.
struct RowSplit {
  std::vector<Eigen::Index> searched;
  std::vector<Eigen::Index> held_out;
  std::vector<Eigen::Index> repeats;  // of the searched rows: equal numbers for equal inputs
};

/// Rows of equal inputs, the order aside, keep together.
RowSplit split_rows(const Inputs& inputs, const MissingOptions& options);

FitData without_samples(const FitData& data, const std::vector<std::size_t>& left_out);

struct TermQuestion {
  Evidence evidence;
  std::vector<PlacedTerm> options;  // one for each candidate
  std::vector<EffectCandidate> candidates;
};

/// The question at the present estimates. The found terms compete again, with what they explain added back to the
/// residuals. Constants of the other terms are tried on the residuals without the samples in `outliers`.
TermQuestion ask(const TermModel& model, const FitData& data, const TermFit& fit,
                 const std::vector<Eigen::Index>& repeats, const std::vector<std::size_t>& outliers);

/// Moves constants of terms to a better value, if there is one now that everything else is fitted. Returns whether any
/// was moved.
bool retry_constants(const TermModel& model, const FitData& data, TermFit& fit);

/// Sets the errors of constants that are not smooth, see trial_error().
void set_trial_errors(const TermModel& model, const FitData& data, TermFit& fit);

}  // namespace llmt::discovery
