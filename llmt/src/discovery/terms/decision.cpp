#include "discovery/terms/decision.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <string>

#include "discovery/terms/approximations.hpp"

namespace llmt::discovery {
namespace {

bool is_raised(const Missing& missing, Reason reason) {
  return std::ranges::find(missing.objections, reason, &Objection::reason) != missing.objections.end();
}

// What the terms that were found are.
enum class Certainty { any, none, tentative, rivalled, certain };

// A state whose size is beyond chance. A spring gives way: its compliance is positive.
bool is_certain_state(const FoundTerm& found) {
  constexpr double certain = 2.0;  // standard errors
  if (found.inner_state.empty()) return false;
  const TermValue& first = found.values.front();
  return (found.family == "drive_spring" ? first.value : std::abs(first.value)) > certain * first.standard_error;
}

struct Ruling {
  bool (*applies)(const Missing&);
  Certainty terms;
  Answer answer;
};

constexpr auto always = [](const Missing&) { return true; };

constexpr std::array<Ruling, 11> rulings = {{
    {[](const Missing& missing) { return is_raised(missing, Reason::larger_error); }, Certainty::any,
     Answer::failed_held_out},
    {[](const Missing& missing) { return std::ranges::any_of(missing.found, is_certain_state); }, Certainty::any,
     Answer::inner_state},
    {[](const Missing& missing) { return missing.verdict.answer == Answer::unknown; }, Certainty::any, Answer::unknown},
    {[](const Missing& missing) { return !missing.structure.empty(); }, Certainty::none, Answer::unknown},
    {[](const Missing& missing) { return is_raised(missing, Reason::known_noise); }, Certainty::none,
     Answer::undecided},
    {[](const Missing& missing) { return missing.parameters_explain; }, Certainty::none, Answer::parameters_only},
    {[](const Missing& missing) { return is_raised(missing, Reason::drift); }, Certainty::none, Answer::unknown},
    {always, Certainty::none, Answer::nothing_missing},
    {always, Certainty::tentative, Answer::unknown},
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
  return has_rivals ? Certainty::rivalled : Certainty::certain;
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
    if (!(gap.after > far * gap.known_noise)) continue;
    std::vector<std::size_t> terms;
    for (std::size_t k = 0; k < missing.found.size(); ++k) {
      if (missing.found[k].output == gap.output && missing.found[k].inner_state.empty()) terms.push_back(k);
    }
    if (missing.found.empty()) missing.visible.clear();  // what is left would hide them
    if (missing.found.empty() || !terms.empty()) object(missing, Reason::known_noise, terms);
    missing.notes.push_back(fmt::format(
        "what is left of {} is {:.3g} times its known noise ({:.2g}): {}", gap.output, gap.after / gap.known_noise,
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
      return "it is one of several terms of the same inputs, which may stand for one that was not tried";
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

}  // namespace llmt::discovery
