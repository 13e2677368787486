// The answer and what is confirmed, decided in one place from the verdict of the search and the objections to it.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "discovery/answer/judges.hpp"

namespace llmt::discovery {
namespace {

// Coulomb and viscous friction are one law of a speed.
std::string kind_of(const FoundTerm& found) {
  return found.family == "sign" || found.family == "linear" ? "dry and viscous" : found.family;
}

bool has_rival_of(const FoundTerm& found, const std::string& input) {
  return std::ranges::any_of(found.rivals, [&](const RivalTerms& rival) {
    return std::ranges::find(rival.inputs, input) != rival.inputs.end();
  });
}

std::vector<std::string> sorted_inputs(const FoundTerm& found) {
  std::vector<std::string> inputs = found.inputs;
  std::ranges::sort(inputs);
  return inputs;
}

// Inputs and output of a term. One for which an offset could stand is, in time, also where a function of one input
// would explain as well in its place.
using Place = std::pair<std::vector<std::string>, Eigen::Index>;
std::vector<Place> places_of(const FoundTerm& found, bool in_time) {
  constexpr std::size_t most_inputs = 2;
  std::vector<Place> places;
  if (!found.inputs.empty() && found.inputs.size() <= most_inputs) {
    places.emplace_back(sorted_inputs(found), found.output_index);
  }
  const bool is_like_an_offset =
      found.inputs.empty() || std::ranges::any_of(found.rivals, [](const RivalTerms& r) { return r.what == "offset"; });
  for (const RivalTerms& rival : found.rivals) {
    if (in_time && is_like_an_offset && rival.inputs.size() == 1) places.emplace_back(rival.inputs, found.output_index);
  }
  return places;
}

// Of each term found, whether it and others may only approximate one that was not tried: three or more kinds of one
// input (in time, two of which one has a rival of that input), two terms of the same two inputs, or two that each act
// in a part alone: functions in parts approximate any other one, as the leaves of a tree do. A term for which
// an offset could stand counts, in time, as one of each input of which a function could stand for it too.
std::vector<bool> approximations(const std::vector<FoundTerm>& all, bool in_time) {
  // Terms of one input are counted by kinds, as there may be several steps. A product and a square times the other
  // input are as much of a power series in two inputs as the terms have.
  constexpr std::array<std::size_t, 2> too_many = {3, 2};
  std::map<Place, std::set<std::string>> kinds;
  std::set<Place> uncertain;
  std::map<Eigen::Index, int> in_regimes;
  for (const FoundTerm& found : all) {
    if (!found.regime.empty()) ++in_regimes[found.output_index];
    for (const Place& place : places_of(found, in_time)) {
      const std::vector<std::string>& inputs = place.first;
      if (in_time && inputs.size() == 1 && has_rival_of(found, inputs.front())) uncertain.insert(place);
      kinds[place].insert(inputs.size() == 1 ? kind_of(found) : found.family + " " + found.location);
    }
  }
  std::vector<bool> approximate;
  for (const FoundTerm& found : all) {
    const bool is_among_parts = !found.regime.empty() && in_regimes[found.output_index] > 1;
    approximate.push_back(is_among_parts || std::ranges::any_of(places_of(found, in_time), [&](const Place& place) {
                            return kinds[place].size() + (uncertain.contains(place) ? 1 : 0) >=
                                   too_many[place.first.size() - 1];
                          }));
  }
  return approximate;
}

bool is_raised(const Missing& missing, Reason reason) {
  return std::ranges::find(missing.objections, reason, &Objection::reason) != missing.objections.end();
}

// What the terms that were found are.
enum class Certainty { any, none, tentative, rivalled, certain };

// A state whose size is beyond chance. A spring gives way: its compliance is positive.
bool is_certain_state(const FoundTerm& found) {
  if (found.inner_state.empty()) return false;
  const TermValue& first = found.values.front();
  return (found.family == "drive_spring" ? first.value : std::abs(first.value)) > certainly * first.standard_error;
}

// Whether what was fitted leaves, on the rows set aside, at most `share` of the squares that the simulation as given
// leaves there: (after / nominal)^2, in the mean of the outputs that it changes.
bool leaves_at_most(double share, const Missing& missing) {
  double outputs = 0.0;
  double left = 0.0;
  for (const Gap& gap : missing.gaps) {
    if (gap.after == gap.nominal) continue;
    left += gap.nominal > 0.0 ? std::pow(gap.after / gap.nominal, 2.0) : 1.0;
    outputs += 1.0;
  }
  return left <= share * outputs;
}

struct Ruling {
  bool (*applies)(const Missing&);
  Certainty terms;
  Answer answer;
};

constexpr auto always = [](const Missing&) { return true; };

constexpr std::array<Ruling, 12> rulings = {{
    {[](const Missing& missing) { return is_raised(missing, Reason::larger_error); }, Certainty::any,
     Answer::failed_held_out},
    {[](const Missing& missing) { return std::ranges::any_of(missing.found, is_certain_state); }, Certainty::any,
     Answer::inner_state},
    {[](const Missing& missing) { return missing.verdict.answer == Answer::unknown; }, Certainty::any, Answer::unknown},
    {[](const Missing& missing) { return !missing.structure.empty(); }, Certainty::none, Answer::unknown},
    {[](const Missing& missing) { return is_raised(missing, Reason::known_noise); }, Certainty::none,
     Answer::undecided},
    {[](const Missing& missing) { return missing.parameters_explain && leaves_at_most(1.0, missing); }, Certainty::none,
     Answer::parameters_only},
    {[](const Missing& missing) { return is_raised(missing, Reason::drift); }, Certainty::none, Answer::unknown},
    {always, Certainty::none, Answer::nothing_missing},
    {always, Certainty::tentative, Answer::unknown},
    {[](const Missing& missing) { return is_raised(missing, Reason::rival); }, Certainty::rivalled, Answer::undecided},
    {always, Certainty::rivalled, Answer::indistinguishable},
    {always, Certainty::certain, Answer::named},
}};

Certainty certainty_of(const Missing& missing) {
  if (missing.found.empty()) return Certainty::none;
  const bool has_other_objections = std::ranges::any_of(
      missing.objections, [](const Objection& objection) { return objection.reason != Reason::rival; });
  if (has_other_objections) return Certainty::tentative;
  const bool has_rivals =
      std::ranges::any_of(missing.found, [](const FoundTerm& found) { return !found.rivals.empty(); });
  return has_rivals || is_raised(missing, Reason::rival) ? Certainty::rivalled : Certainty::certain;
}

}  // namespace

void object(Missing& missing, Reason reason, const std::vector<std::size_t>& terms) {
  missing.objections.push_back({reason, terms});
}

void judge_findings(Missing& missing, bool in_time) {
  const std::vector<bool> approximate = approximations(missing.found, in_time);
  std::set<std::vector<std::string>> noted;
  if (!missing.failing_rows.empty()) object(missing, Reason::larger_error);
  for (std::size_t k = 0; k < missing.found.size(); ++k) {
    const FoundTerm& found = missing.found[k];
    if (found.generic) object(missing, Reason::shape, {k});
    if (!found.shrinks_gap) object(missing, Reason::no_gain, {k});
    if (!found.inner_state.empty() && !is_certain_state(found)) object(missing, Reason::vague_state, {k});
    if (std::ranges::find(missing.structure, found.output, &Structure::output) != missing.structure.end()) {
      object(missing, Reason::structure, {k});
    }
    if (!approximate[k]) continue;
    object(missing, Reason::approximation, {k});
    if (found.inputs.empty() || !noted.insert(sorted_inputs(found)).second) continue;
    missing.notes.push_back(
        fmt::format("there are many terms of {}: together they may approximate one that was not tried",
                    fmt::join(sorted_inputs(found), " and ")));
  }
}

void judge_noise(Missing& missing) {
  constexpr double far = 5.0;
  for (const Gap& gap : missing.gaps) {
    // An effect that acts in few stretches may act in none of those set aside.
    const double left = std::max(gap.after, gap.noise_floor);
    if (!(left > far * gap.known_noise)) continue;
    std::vector<std::size_t> terms;
    for (std::size_t k = 0; k < missing.found.size(); ++k) {
      if (missing.found[k].output == gap.output && missing.found[k].inner_state.empty()) terms.push_back(k);
    }
    if (missing.found.empty()) missing.visible.clear();  // what is left would hide them
    if (missing.found.empty() || !terms.empty()) object(missing, Reason::known_noise, terms);
    missing.notes.push_back(fmt::format(
        "what is left of {} is {:.3g} times its known noise ({:.2g}): {}", gap.output, left / gap.known_noise,
        gap.known_noise, missing.found.empty() ? "no term tried explains it" : "something more is missing"));
  }
}

void decide(Missing& missing) {
  std::set<Eigen::Index> doubtful;
  bool is_refused = missing.verdict.answer == Answer::unknown;
  for (const Objection& objection : missing.objections) {
    is_refused = is_refused || objection.terms.empty();
    for (const std::size_t term : objection.terms) doubtful.insert(missing.found[term].output_index);
  }
  for (FoundTerm& found : missing.found) found.confirmed = !is_refused && !doubtful.contains(found.output_index);
  const Certainty terms = certainty_of(missing);
  const auto applies = [&](const Ruling& row) {
    return (row.terms == Certainty::any || row.terms == terms) && row.applies(missing);
  };
  missing.answer = std::ranges::find_if(rulings, applies)->answer;
}

std::string to_string(Reason reason) {
  switch (reason) {
    case Reason::larger_error:
      return "the error on the rows set aside is larger with what was found";
    case Reason::known_noise:
      return "more is left than 5 times the known noise";
    case Reason::drift:
      return "what is left changes too slowly to tell";
    case Reason::shape:
      return "it is a shape, not a cause";
    case Reason::structure:
      return "what is left still depends on the inputs";
    case Reason::approximation:
      return "it is one of several terms of the same inputs, or in parts, which may stand for one that was not tried";
    case Reason::no_gain:
      return "it does not make the error on the rows set aside smaller";
    case Reason::vague_state:
      return "its size is within two standard errors of 0";
    case Reason::errors_of_inputs:
      return "errors of the inputs alone could make it";
    case Reason::rival:
      return "another function explains these rows as well";
    case Reason::likelier:
      return "other terms, which are not certain either, explain these rows better";
  }
  return "";
}

bool is_drift(const Missing& missing) {
  constexpr double fewest = 10.0;
  // Rows may also be few.
  return missing.time.in_time && missing.found.empty() && missing.time.independent_share < alike_in_neighbours &&
         missing.time.independent_share * static_cast<double>(missing.time.samples) < fewest;
}

bool is_worse(const Missing& missing) {
  // Without terms there is nothing to leave out; rounding and corrected parameters may differ from the fit before.
  if (missing.found.empty() && missing.answer != Answer::failed_held_out) return false;
  double left = 0.0;
  for (const Gap& gap : missing.gaps) left += gap.after == gap.before ? 1.0 : std::pow(gap.after / gap.before, 2.0);
  return missing.answer == Answer::failed_held_out || left > static_cast<double>(missing.gaps.size());
}

bool are_terms_held(const Missing& missing) { return !std::ranges::all_of(missing.found, &FoundTerm::confirmed); }

bool may_be_applied(const Missing& missing) {
  constexpr double half = 0.5;
  switch (missing.answer) {
    case Answer::nothing_missing:
    case Answer::failed_held_out:
      return false;
    case Answer::parameters_only:  // nothing was added, so the simulation as it was given is what counts
      return leaves_at_most(1.0, missing);
    case Answer::unknown:
    case Answer::undecided:
      // May stand for something else, but for functions that fit alike.
      return !is_worse(missing) && (leaves_at_most(half, missing) || certainty_of(missing) == Certainty::rivalled);
    default:
      return !is_worse(missing);
  }
}

}  // namespace llmt::discovery
