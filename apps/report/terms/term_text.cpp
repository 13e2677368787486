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
  return text + " " + value.unit;
}

bool has_nominal(const discovery::FittedParameter& fitted, const std::vector<std::string>& without_nominal) {
  return std::ranges::none_of(fitted.parts, [&](const std::string& part) {
    return std::ranges::find(without_nominal, part) != without_nominal.end();
  });
}

std::string headline(const discovery::Missing& missing) {
  const auto causes = std::ranges::count_if(missing.found, [](const auto& f) { return !f.generic; });
  const auto sure = std::ranges::count_if(missing.found, &discovery::FoundTerm::confirmed);
  const std::string terms = causes == 1 ? "one term is" : fmt::format("{} terms are", causes);
  switch (missing.answer) {
    case discovery::Answer::nothing_missing:
      return "nothing is missing that these rows could show";
    case discovery::Answer::named:
      return terms + (sure < causes ? " missing, but not all of this is certain" : " missing");
    case discovery::Answer::indistinguishable:
      return terms + " missing, but other terms explain it as well";
    case discovery::Answer::unknown:
      return "something is missing that no term tried explains";
    case discovery::Answer::parameters_only:
      return "nothing is missing, but " + changed_parameters(missing);
  }
  return "";
}

}  // namespace llmt::report
