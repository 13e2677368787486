/// \file
/// Plain words for what a fit compares, and the best of each word.
#pragma once

#include <string>
#include <vector>

#include "llmt/summary.hpp"

namespace llmt::report {

/// "smooth blend", "crisp tree", "crisp tree, sparse", ...
std::string kind_of(const Candidate& candidate);

/// The chosen candidate, then the best of every other kind, in the order of PartitionSummary::best_of_kind.
std::vector<CandidateError> best_of_kinds(const PartitionSummary& partition);

}  // namespace llmt::report
