#include "report/terms/term_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "report/text/text.hpp"

namespace llmt::report {

namespace {

// "mass and damping are off their nominal values".
std::string changed_parameters(const discovery::Missing& missing) {
  std::vector<std::string> names;
  for (const discovery::FittedParameter& fitted : missing.fitted_parameters) {
    if (fitted.changed) names.push_back(fitted.name);
  }
  // Together they may be beyond chance although none is by itself.
  if (names.empty()) return "parameters of the simulation are off their nominal values";
  if (names.size() == 1) return names.front() + " is off its nominal value";
  const std::string last = names.back();
  names.pop_back();
  return fmt::format("{} and {} are off their nominal values", fmt::join(names, ", "), last);
}

}  // namespace

std::string title_of(const discovery::FoundTerm& found, bool several_outputs) {
  std::string text = found.generic ? "unknown: " + found.formula : found.family;
  if (!found.generic && !found.location.empty()) text += " of " + found.location;
  if (several_outputs) text += ", on " + found.output;
  return text;
}

std::string value_text(const discovery::TermValue& value) {
  std::string text = fmt::format("{} = {}", value.name, number(value.value));
  if (std::isfinite(value.standard_error)) text += fmt::format(" +- {}", number(value.standard_error, 2));
  return value.unit == "1" ? text : text + " " + value.unit;
}

std::string time_text(const discovery::TimeUse& time, const std::string& column) {
  const std::string unit = column.empty() ? " rows" : fmt::format(" in {}", column);
  std::string text = fmt::format(
      "Rows in time, {}{} apart{}: ", number(time.step, 3), unit,
      time.found_out ? " (found out: the inputs are smooth along the rows; --time COLUMN names their time)" : "");
  text += time.rows_per_sample == 1
              ? fmt::format("{} are searched as they are.", time.samples)
              : fmt::format("{} means over {} rows each are searched.", time.samples, time.rows_per_sample);
  constexpr double hardly = 0.9;
  if (time.independent_share < hardly) {
    text += fmt::format("\nWhat is left is correlated over {}{}: {:.0f} % of the {} count as independent.",
                        number(time.correlation_time, 2), unit, 100.0 * time.independent_share,
                        time.rows_per_sample == 1 ? "rows" : "means");
  }
  return text + "\n";
}

bool has_nominal(const discovery::FittedParameter& fitted, const std::vector<std::string>& without_nominal) {
  return std::ranges::none_of(fitted.parts, [&](const std::string& part) {
    return std::ranges::find(without_nominal, part) != without_nominal.end();
  });
}

namespace {

// "this has an inner state: a spring in the drive (q). An encoder behind the spring would show it"
std::string inner_state_text(const discovery::Missing& missing) {
  std::string text = "this has an inner state";
  std::string shown_by;
  const char* sign = ": ";
  for (const discovery::FoundTerm& found : missing.found) {
    if (found.inner_state.empty()) continue;
    const discovery::TermValue& value = found.values.front();
    text += fmt::format("{}{}{} ({})", sign, found.inner_state, missing.gaps.size() > 1 ? " of " + found.output : "",
                        value_text(value));
    if (shown_by.find(found.shown_by) == std::string::npos) {
      shown_by += (shown_by.empty() ? "" : "; ") + found.shown_by;
    }
    sign = " and ";
  }
  const auto others = std::ranges::count_if(
      missing.found, [](const discovery::FoundTerm& found) { return found.inner_state.empty() && !found.generic; });
  if (others > 0) text += fmt::format(", and {} more {} missing", others, others == 1 ? "term is" : "terms are");
  return text + ". It would be seen in " + shown_by;
}

// "undecided: what is left of u is 148 times its noise, and no term tried explains it".
std::string undecided_text(const discovery::Missing& missing, const std::string& terms) {
  if (!missing.found.empty())
    return "undecided: " + terms + " missing, but these rows do not tell which function it is";
  const auto times = [](const discovery::Gap& gap) {
    return gap.known_noise > 0.0 ? gap.after / gap.known_noise : 0.0;
  };
  const auto most = std::ranges::max_element(missing.gaps, {}, times);
  return fmt::format("undecided: what is left of {} is {:.3g} times its noise, and no term tried explains it",
                     most->output, times(*most));
}

}  // namespace

std::string headline(const discovery::Missing& missing) {
  const auto causes = std::ranges::count_if(missing.found, [](const auto& f) { return !f.generic; });
  const auto sure = std::ranges::count_if(missing.found, &discovery::FoundTerm::confirmed);
  const std::string terms = causes == 1 ? "one term is" : fmt::format("{} terms are", causes);
  constexpr double hardly = 0.9;
  const bool is_correlated = missing.time.in_time && missing.time.independent_share < hardly;
  switch (missing.answer) {
    case discovery::Answer::nothing_missing:
      return is_correlated ? "nothing is missing beyond noise that is alike in neighbouring rows"
                           : "nothing is missing that these rows could show";
    case discovery::Answer::named:
      return terms + " missing";
    case discovery::Answer::indistinguishable:
      return terms + " missing, but other terms explain it as well";
    case discovery::Answer::unknown:
      if (is_drift(missing)) {
        return fmt::format(
            "these rows cannot tell what is missing: what is left changes so slowly that they hold {:.1f} "
            "independent values of it",
            missing.time.independent_share * static_cast<double>(missing.time.samples));
      }
      return sure == 0 ? "something is missing that no term tried explains"
                       : fmt::format("{} missing, and something more that no term tried explains",
                                     sure == 1 ? "one term is" : fmt::format("{} terms are", sure));
    case discovery::Answer::failed_held_out:
      return "failed on held-out rows: with the terms found the error on the rows set aside is larger";
    case discovery::Answer::parameters_only:
      return "nothing is missing, but " + changed_parameters(missing);
    case discovery::Answer::inner_state:
      return inner_state_text(missing);
    case discovery::Answer::undecided:
      return undecided_text(missing, terms);
  }
  return "";
}

std::string headline_with_names(const discovery::Missing& missing) {
  constexpr std::size_t most = 4;  // names
  const auto joined = [&](bool confirmed) {
    std::vector<std::string> names;
    std::size_t more = 0;
    for (const discovery::FoundTerm& found : missing.found) {
      if (found.generic || found.confirmed != confirmed) continue;
      if (names.size() < most) {
        names.push_back(title_of(found, missing.gaps.size() > 1));
      } else {
        ++more;
      }
    }
    return fmt::format("{}{}", fmt::join(names, ", "), more > 0 ? fmt::format(" and {} more", more) : "");
  };
  const std::string sure = joined(true);
  const std::string alike = joined(false);
  std::string text = headline(missing);
  if (!sure.empty()) text += ": " + sure;
  if (!alike.empty()) text += fmt::format("{} looks like {}", sure.empty() ? "; it" : "; the rest", alike);
  return text;
}

std::string gap_sentence(const discovery::Missing& missing) {
  if (missing.found.empty() || missing.held_out.empty()) return "";
  std::vector<std::string> parts;
  for (const discovery::Gap& gap : missing.gaps) {
    parts.push_back(fmt::format("{} from {} to {}", gap.output, number(gap.before, 3), number(gap.after, 3)));
  }
  return fmt::format("On rows set aside {} the error of {}.", missing.found.size() == 1 ? "it takes" : "they take",
                     fmt::join(parts, ", "));
}

}  // namespace llmt::report
