// Rounds of search and fit.
#pragma once

#include "discovery/terms/input_noise.hpp"
#include "discovery/terms/missing_findings.hpp"
#include "discovery/terms/sample_weights.hpp"
#include "llmt/progress.hpp"

namespace llmt::discovery {

/// Root mean square of what is left of each output, in its own unit; 1 where nothing is left.
Eigen::VectorXd scatter(const TermModel& model, const TermData& data, const TermFit& fit);

/// Searches and fits until the found set stays the same: first the terms of rows by themselves, then beside them those
/// that depend on earlier rows, which stay if they explain better by the rivals' margin. The weights of the outputs in
/// `data`, those of the samples, and the share of the samples that is independent, follow what each round leaves.
Settled search_terms(const TermModel& model, TermData& data, const std::vector<Eigen::Index>& repeats,
                     const TermFit& baseline, const KnownErrors& errors, const MissingOptions& options, Work& work);

}  // namespace llmt::discovery
