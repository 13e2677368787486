#include "discovery/terms/alternatives.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "discovery/terms/missing_findings.hpp"

namespace llmt::discovery {
namespace {

constexpr double clearly_less = 0.8;
constexpr double immaterial = 0.01;  // of the squares of the gap

// Sum over the outputs of the squared errors on the samples set aside, in units of those that `reference` has before
// its terms. Each search leaves out other outliers, so units of its own would not be comparable.
double left_on_held_out(const Missing& missing, const Missing& reference) {
  double left = 0.0;
  for (std::size_t o = 0; o < missing.gaps.size(); ++o) {
    const double before = reference.gaps[o].before;
    left += before > 0.0 ? std::pow(missing.gaps[o].after / before, 2.0) : 0.0;
  }
  return left;
}

// A share of the simulated output, of its square or of its size.
bool is_share_of_the_simulation(const std::string& family) {
  return family == "gain" || family == "gain_curvature" || family == "load_friction";
}

bool is_gain(const FoundTerm& term) { return is_share_of_the_simulation(term.family) && term.regime.empty(); }

Eigen::Index fitted_numbers(const Missing& missing) {
  Eigen::Index count = 0;
  for (const FoundTerm& term : missing.found) count += term.coefficients.size() + term.constants.size();
  return count;
}

// The logarithm of the ratio of likelihoods of two answers on the rows that both set aside and that are no outliers of
// both.
double evidence_against(const Missing& other, const Missing& found, const MeasuredOutputs& measured) {
  constexpr double far = 5.0;  // noise floors
  const std::set<Eigen::Index> aside(found.held_out.begin(), found.held_out.end());
  double evidence = 0.0;
  for (Eigen::Index o = 0; o < measured.values.cols(); ++o) {
    double left = 0.0;
    double left_by_other = 0.0;
    double rows = 0.0;
    for (const Eigen::Index row : other.held_out) {
      if (!aside.contains(row)) continue;
      const double own = measured.values(row, o) - found.corrected(row, o);
      const double others = measured.values(row, o) - other.corrected(row, o);
      if (std::min(std::abs(own), std::abs(others)) > far * found.gaps[static_cast<std::size_t>(o)].noise_floor)
        continue;
      left += own * own;
      left_by_other += others * others;
      rows += 1.0;
    }
    const double samples = found.time.independent_share * rows / static_cast<double>(found.time.rows_per_sample);
    if (left > 0.0) {
      evidence += 0.5 * samples * (left_by_other / left - 1.0);
    } else if (left_by_other > 0.0) {
      return std::numeric_limits<double>::infinity();  // `found` is exact
    }
  }
  return evidence;
}

// Those terms of `other` that are not among `beside`, on the output of `term`.
RivalTerms in_its_place(const FoundTerm& term, const std::vector<FoundTerm>& beside, const Missing& other) {
  RivalTerms rival;
  for (const FoundTerm& instead : other.found) {
    const bool is_shared = std::ranges::any_of(beside, [&](const FoundTerm& own) {
      return own.term == instead.term && own.output_index == instead.output_index;
    });
    if (is_shared || instead.output_index != term.output_index) continue;
    rival.what +=
        (rival.what.empty() ? "" : " + ") + instead.family + (instead.location.empty() ? "" : " " + instead.location);
    rival.inputs.insert(rival.inputs.end(), instead.inputs.begin(), instead.inputs.end());
  }
  return rival;
}

// The plain terms of `place`, with those of `other` as rivals.
Missing with_rivals(const std::vector<std::string>& place, Missing plain, const Missing& other) {
  const std::vector<FoundTerm> beside = plain.found;
  for (FoundTerm& term : plain.found) {
    if (term.inputs != place) continue;
    const RivalTerms rival = in_its_place(term, beside, other);
    if (rival.what.empty()) continue;
    term.rivals.insert(term.rivals.begin(), rival);
    if (plain.answer == Answer::named) plain.answer = Answer::indistinguishable;
  }
  return plain;
}

// Terms with a constant, of `place`, for which those of `plain` could stand. If these are approximations, so may they
// be.
void doubt_searched(const std::vector<std::string>& place, const Missing& plain, bool holds, Missing& found) {
  for (FoundTerm& term : found.found) {
    if (term.inputs != place || term.constants.size() == 0 || term.generic) continue;
    const RivalTerms rival = in_its_place(term, found.found, plain);
    if (rival.what.empty()) continue;
    term.rivals.insert(term.rivals.begin(), rival);
    if (found.answer == Answer::named) found.answer = Answer::indistinguishable;
    if (!holds) term.confirmed = false;
  }
  demand_certainty(found);
}

}  // namespace

bool has_gain(const Missing& missing) { return std::ranges::any_of(missing.found, is_gain); }

std::set<std::size_t> shares_of_the_simulation(const std::vector<ModelTerm>& terms) {
  std::set<std::size_t> shares;
  for (std::size_t t = 0; t < terms.size(); ++t) {
    if (is_share_of_the_simulation(terms[t].family) && terms[t].regime.empty()) shares.insert(t);
  }
  return shares;
}

std::set<std::size_t> terms_of_regimes(const std::vector<ModelTerm>& terms) {
  std::set<std::size_t> regimes;
  for (std::size_t t = 0; t < terms.size(); ++t) {
    if (!terms[t].regime.empty()) regimes.insert(t);
  }
  return regimes;
}

bool leaves_something(const Missing& missing) {
  constexpr double alike = 0.5;  // independent share
  constexpr double as_noise = 2.0;
  const auto is_noise = [&](const Gap& gap) { return gap.after <= as_noise * gap.known_noise; };
  if (missing.answer == Answer::inner_state || std::ranges::all_of(missing.gaps, is_noise)) return false;
  if (missing.time.in_time && missing.time.independent_share < alike) return true;
  return missing.answer == Answer::unknown || missing.answer == Answer::undecided ||
         missing.answer == Answer::failed_held_out || !missing.structure.empty();
}

Missing regimes_for_unknown(Missing found, Missing of_regimes) {
  const bool holds = (of_regimes.answer == Answer::named || of_regimes.answer == Answer::indistinguishable) &&
                     std::ranges::any_of(of_regimes.found, [](const FoundTerm& term) { return !term.regime.empty(); });
  if (!holds) return found;
  return left_on_held_out(of_regimes, found) < clearly_less * left_on_held_out(found, found) ? of_regimes : found;
}

Missing inputs_for_gain(Missing found, Missing of_inputs, const MeasuredOutputs& measured, double rival_margin) {
  const bool has_shapes = std::ranges::any_of(of_inputs.found, &FoundTerm::generic);
  if (of_inputs.answer == Answer::failed_held_out || has_shapes ||
      evidence_against(of_inputs, found, measured) > rival_margin) {
    return found;
  }
  const bool is_certain = of_inputs.answer == Answer::named || of_inputs.answer == Answer::indistinguishable;
  if (is_certain && of_inputs.found.size() < found.found.size()) return of_inputs;
  const std::vector<FoundTerm> beside = found.found;
  for (FoundTerm& gain : found.found) {
    if (!is_gain(gain)) continue;
    const RivalTerms rival = in_its_place(gain, beside, of_inputs);
    if (rival.what.empty()) continue;
    gain.rivals.insert(gain.rivals.begin(), rival);
    if (found.answer == Answer::named) found.answer = Answer::indistinguishable;
    if (!is_certain) gain.confirmed = false;
  }
  demand_certainty(found);
  return found;
}

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
  const bool is_better = holds && left_on_held_out(of_state, found) < left_on_held_out(found, found);
  return is_better ? of_state : found;
}

Missing Alternatives::terms_for_state(Missing found) const {
  if (!has_judges(found) || found.answer != Answer::inner_state) return found;
  Missing plain = without(*refuted_, [](const ModelTerm& term) { return !term.inner_state.empty(); });
  const auto holds = [](const FoundTerm& term) { return term.confirmed && !term.generic; };
  const bool is_plain = !plain.found.empty() && plain.found.size() <= found.found.size() &&
                        plain.answer != Answer::failed_held_out && std::ranges::all_of(plain.found, holds);
  if (!is_plain) return found;
  constexpr double nearly_nothing = 0.1;  // of the squares of the gap: what shows a state explains it
  const double left = left_on_held_out(plain, found);
  const bool explains_all = left < nearly_nothing * static_cast<double>(found.gaps.size());
  return explains_all && left <= left_on_held_out(found, found) + immaterial ? plain : found;
}

Missing Alternatives::causes_for_shapes(Missing found) const {
  if (!has_judges(found) || std::ranges::none_of(found.found, &FoundTerm::generic)) return found;
  Missing of_causes = without(*refuted_, [](const ModelTerm& term) { return term.generic; });
  constexpr double as_little = 1.1;
  const double left = left_on_held_out(found, found);
  const bool is_as_good = of_causes.answer != Answer::failed_held_out && !of_causes.found.empty() &&
                          left_on_held_out(of_causes, found) <= std::max(as_little * left, left + immaterial);
  return is_as_good ? of_causes : found;
}

Missing Alternatives::plain_for_searched(Missing found) const {
  if (!has_judges(found) || found.answer == Answer::inner_state) return found;
  std::set<std::vector<std::string>> places;
  for (const FoundTerm& term : found.found) {
    if (!term.generic && term.constants.size() > 0 && term.inputs.size() == 1) places.insert(term.inputs);
  }
  for (const std::vector<std::string>& place : places) {
    const auto is_searched = [&](const ModelTerm& term) { return term.inputs == place && !term.constants.empty(); };
    const auto has_shapes = [](const Missing& missing) {
      return std::ranges::any_of(missing.found, &FoundTerm::generic);
    };
    Missing plain = without(*refuted_, is_searched);
    if (has_shapes(plain) && !has_shapes(found)) {
      plain = without(*refuted_, [&](const ModelTerm& term) { return is_searched(term) || term.generic; });
    }
    if (plain.found.empty() || has_shapes(plain)) continue;
    const double ratio = left_on_held_out(plain, found) / left_on_held_out(found, found);
    const bool holds = std::ranges::all_of(plain.found, &FoundTerm::confirmed);
    const bool has_fewer = fitted_numbers(plain) < fitted_numbers(found);
    if ((holds && ratio < clearly_less) || (has_fewer && ratio < 1.0)) {
      found = std::move(plain);
      continue;
    }
    const double margin = options_->search.rival_margin;
    const double evidence = evidence_against(plain, found, *measured_);
    // The margin is of the rows searched, the evidence of those set aside.
    const double of_aside = static_cast<double>(found.held_out.size()) / static_cast<double>(found.searched.size());
    if (holds && fitted_numbers(plain) <= fitted_numbers(found) && evidence <= of_aside * margin) {
      found = with_rivals(place, std::move(plain), found);
    } else if (evidence <= margin) {
      doubt_searched(place, plain, holds, found);
    }
  }
  return found;
}

}  // namespace llmt::discovery
