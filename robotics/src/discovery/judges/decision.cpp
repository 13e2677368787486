#include "discovery/judges/decision.hpp"

#include <algorithm>
#include <optional>

namespace llmt::robotics {
namespace {

using discovery::Answer;

// The names that are confirmed.
enum class Certainty {
  no_names,
  none,             // there are names, but none is confirmed
  smaller,          // only names found beside larger ones
  larger,           // a name that was not found beside larger ones
  smaller_rivalled  // the same, and one found beside larger ones has rivals
};

constexpr bool is_against_verdict(Reason reason) { return reason <= Reason::held_out_loss; }

enum class Against { anything, nothing };  // the reasons against the verdict that a row allows

// An empty list stands for every value; a reason must be among those raised.
struct Row {
  std::vector<Answer> verdicts;
  std::optional<Reason> reason;
  Against against;
  std::vector<Certainty> confirmed;
  Answer answer;
  Headline headline;
};

const std::vector<Row>& table() {
  using enum Certainty;
  using enum Against;
  const std::vector<Answer> named = {Answer::named, Answer::indistinguishable};
  static const std::vector<Row> rows = {
      {{}, Reason::gross_errors, anything, {}, Answer::unknown, Headline::gross_errors},
      {{}, Reason::structured_residuals, anything, {}, Answer::unknown, Headline::structured_residuals},
      {{Answer::nothing_missing}, {}, anything, {}, Answer::nothing_missing, Headline::nothing_missing},
      {{}, Reason::held_out_loss, anything, {none}, Answer::unknown, Headline::likely_causes_unwritten},
      {{Answer::named}, {}, nothing, {larger}, Answer::named, Headline::named},
      {named, {}, nothing, {larger, smaller_rivalled}, Answer::indistinguishable, Headline::named_with_rivals},
      {named, {}, nothing, {none}, Answer::unknown, Headline::likely_causes},
      {{}, {}, anything, {smaller, larger, smaller_rivalled}, Answer::unknown, Headline::named_in_part},
      {{}, {}, anything, {none}, Answer::unknown, Headline::likely_causes_in_part},
      {{}, {}, anything, {}, Answer::unknown, Headline::unknown},
  };
  return rows;
}

Certainty certainty(const std::vector<Name>& names, const std::vector<bool>& confirmed) {
  bool has_larger = false;
  bool has_smaller = false;
  bool is_rivalled = false;
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (!confirmed[k]) continue;
    (names[k].effect.smaller ? has_smaller : has_larger) = true;
    is_rivalled = is_rivalled || (names[k].effect.smaller && !names[k].effect.rivals.empty());
  }
  if (has_larger) return is_rivalled ? Certainty::smaller_rivalled : Certainty::larger;
  if (has_smaller) return Certainty::smaller;
  return names.empty() ? Certainty::no_names : Certainty::none;
}

}  // namespace

std::vector<bool> unopposed(const std::vector<Objection>& objections, std::size_t names) {
  std::vector<bool> stands(names, true);
  for (const Objection& objection : objections) {
    for (const std::size_t name : objection.names) stands[name] = false;
  }
  return stands;
}

Decision decide(Answer verdict, const std::vector<Objection>& objections, const std::vector<Name>& names) {
  std::vector<bool> confirmed = unopposed(objections, names.size());
  const Certainty certain = certainty(names, confirmed);
  const bool is_undisputed = std::ranges::none_of(objections, is_against_verdict, &Objection::reason);
  const auto has = [](const auto& list, auto value) {
    return list.empty() || std::ranges::find(list, value) != list.end();
  };
  const auto applies = [&](const Row& row) {
    const bool is_raised =
        !row.reason || std::ranges::find(objections, *row.reason, &Objection::reason) != objections.end();
    const bool is_allowed = row.against == Against::anything || is_undisputed;
    return has(row.verdicts, verdict) && is_raised && is_allowed && has(row.confirmed, certain);
  };
  const Row& row = *std::ranges::find_if(table(), applies);
  return {row.answer, row.headline, std::move(confirmed)};
}

}  // namespace llmt::robotics
