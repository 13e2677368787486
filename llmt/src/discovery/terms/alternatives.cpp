#include "discovery/terms/alternatives.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "discovery/terms/missing_findings.hpp"

namespace llmt::discovery {
namespace {

constexpr double clearly_less = 0.8;

// Sum over the outputs of the squared errors on the samples set aside, in units of those before.
double left_on_held_out(const Missing& missing) {
  double left = 0.0;
  for (const Gap& gap : missing.gaps) left += gap.before > 0.0 ? std::pow(gap.after / gap.before, 2.0) : 0.0;
  return left;
}

}  // namespace

Missing Alternatives::without(std::set<std::size_t> refuted,
                              const std::function<bool(const ModelTerm&)>& left_out) const {
  for (std::size_t t = 0; t < terms_->size(); ++t) {
    if (left_out((*terms_)[t])) refuted.insert(t);
  }
  return search_once(*simulation_, *inputs_, *measured_, *terms_, *rows_, *options_, refuted);
}

Missing Alternatives::state_for_terms(Missing found) const {
  const auto is_state = [&](std::size_t t) { return !(*terms_)[t].inner_state.empty(); };
  if (!has_judges(found) || std::ranges::none_of(*refuted_, is_state) || found.answer == Answer::inner_state) {
    return found;
  }
  Missing of_state = without({}, [](const ModelTerm& term) { return term.inner_state.empty(); });
  const bool holds = of_state.answer == Answer::inner_state && beyond_constants(of_state, *terms_).empty();
  const bool is_better = holds && left_on_held_out(of_state) < left_on_held_out(found);
  return is_better ? of_state : found;
}

Missing Alternatives::causes_for_shapes(Missing found) const {
  if (!has_judges(found) || std::ranges::none_of(found.found, &FoundTerm::generic)) return found;
  Missing of_causes = without(*refuted_, [](const ModelTerm& term) { return term.generic; });
  constexpr double as_little = 1.1;
  constexpr double immaterial = 0.01;
  const double left = left_on_held_out(found);
  const bool is_as_good = of_causes.answer != Answer::failed_held_out && !of_causes.found.empty() &&
                          left_on_held_out(of_causes) <= std::max(as_little * left, left + immaterial);
  return is_as_good ? of_causes : found;
}

Missing Alternatives::plain_for_searched(Missing found) const {
  if (!has_judges(found) || found.answer == Answer::inner_state) return found;
  std::set<std::vector<std::string>> places;
  for (const FoundTerm& term : found.found) {
    if (!term.generic && term.constants.size() > 0 && term.inputs.size() == 1) places.insert(term.inputs);
  }
  for (const std::vector<std::string>& place : places) {
    Missing plain =
        without(*refuted_, [&](const ModelTerm& term) { return term.inputs == place && !term.constants.empty(); });
    const auto holds = [](const FoundTerm& term) { return term.confirmed && !term.generic; };
    if (!plain.found.empty() && std::ranges::all_of(plain.found, holds) &&
        left_on_held_out(plain) < clearly_less * left_on_held_out(found)) {
      found = std::move(plain);
    }
  }
  return found;
}

Missing Alternatives::inputs_for_gain(Missing found) const {
  const auto is_gain = [](const FoundTerm& term) { return term.family == "gain"; };
  if (!has_judges(found) || found.answer == Answer::inner_state || std::ranges::none_of(found.found, is_gain)) {
    return found;
  }
  const Missing of_inputs = without(*refuted_, [](const ModelTerm& term) {
    return term.generic || term.family == "gain" || term.family == "gain_curvature" || term.family == "load_friction";
  });
  constexpr double as_little = 1.02;
  if (of_inputs.answer == Answer::failed_held_out ||
      left_on_held_out(of_inputs) > as_little * left_on_held_out(found)) {
    return found;
  }
  const std::vector<FoundTerm> beside = found.found;
  for (FoundTerm& gain : found.found) {
    if (!is_gain(gain)) continue;
    RivalTerms rival;
    for (const FoundTerm& term : of_inputs.found) {
      const bool is_shared = std::ranges::any_of(beside, [&](const FoundTerm& other) {
        return other.term == term.term && other.output_index == term.output_index;
      });
      if (is_shared || term.output_index != gain.output_index) continue;
      rival.what +=
          (rival.what.empty() ? "" : " + ") + term.family + (term.location.empty() ? "" : " " + term.location);
      rival.inputs.insert(rival.inputs.end(), term.inputs.begin(), term.inputs.end());
    }
    if (rival.what.empty()) continue;
    gain.rivals.insert(gain.rivals.begin(), rival);
    if (found.answer == Answer::named) found.answer = Answer::indistinguishable;
  }
  return found;
}

}  // namespace llmt::discovery
