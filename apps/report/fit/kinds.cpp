#include "report/fit/kinds.hpp"

#include <algorithm>

namespace llmt::report {
namespace {

std::string full_kind_of(const Candidate& candidate) {
  const bool one = candidate.leaves == 1;
  switch (candidate.validity.kind) {
    case ValidityKind::crisp:
      return one ? (candidate.shrinkage > 0.0 ? "ridge regression" : "least squares") : "crisp tree";
    case ValidityKind::blend:
      return candidate.jump < no_jump ? "blend that keeps jumps" : "smooth blend";
    case ValidityKind::gaussian:
      return "Gaussians";
    case ValidityKind::logistic:
      return "smooth gates";
  }
  return "";
}

}  // namespace

std::string kind_of(const Candidate& candidate) {
  return full_kind_of(candidate) + (candidate.sparse ? ", sparse" : "");
}

std::vector<CandidateError> best_of_kinds(const PartitionSummary& partition) {
  std::vector<CandidateError> shown = {partition.chosen};
  for (const CandidateError& other : partition.best_of_kind) {
    const auto same = std::ranges::find(shown, kind_of(other.candidate),
                                        [](const CandidateError& entry) { return kind_of(entry.candidate); });
    if (same == shown.end()) {
      shown.push_back(other);
    } else if (same != shown.begin() && other.rmse < same->rmse) {
      *same = other;
    }
  }
  return shown;
}

}  // namespace llmt::report
