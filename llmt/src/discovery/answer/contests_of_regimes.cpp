#include "discovery/answer/contests_of_regimes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "discovery/answer/judges.hpp"

namespace llmt::discovery {
namespace {

using Terms = std::vector<ModelTerm>;
using Left = std::set<std::size_t>;

Left without(const Left& left, const Left& others) {
  Left rest;
  std::ranges::set_difference(left, others, std::inserter(rest, rest.end()));
  return rest;
}

// "dx where x > c" is that of "dx".
bool is_part_of(const ModelTerm& in_regime, const FoundTerm& found) {
  return in_regime.family == found.family &&
         in_regime.location.substr(0, in_regime.location.find("where ")) == found.location + " ";
}

// A threshold among those that were tried, and its neighbours, between which it is refined.
std::vector<double> around(const std::vector<double>& tried, double threshold) {
  const auto place = std::ranges::lower_bound(tried, threshold);
  std::vector<double> all;
  if (place != tried.begin()) all.push_back(*(place - 1));
  all.push_back(threshold);
  const auto next = std::ranges::upper_bound(tried, threshold);
  if (next != tried.end()) all.push_back(*next);
  return all;
}

}  // namespace

std::vector<Others> plain_regimes(const Missing& found, const Terms& terms, const Left& refuted, const Gates&) {
  const Left regimes = terms_of_regimes(terms);
  // Several terms may imitate one that acts in a part.
  if (regimes.empty() || !(leaves_something(found) || found.found.size() > 1)) return {};
  return {{terms, with_those(without(refuted, regimes), terms, [&](const ModelTerm& term) {
             return !term.regime.empty() && term.constants.size() > 1 &&
                    std::ranges::none_of(found.found, [&](const FoundTerm& own) { return is_part_of(term, own); });
           })}};
}

std::vector<Others> regimes_of_size(const Missing& found, const Terms& terms, const Left& refuted,
                                    const Gates& of_size) {
  if (of_size.empty() || !(leaves_something(found) || found.found.size() > 1)) return {};
  Others others{terms, without(refuted, terms_of_regimes(terms))};
  for (std::size_t t = 0; t < terms.size(); ++t) {
    if (terms[t].regime.empty()) continue;
    const auto gate = of_size.find(terms[t].regime);
    std::vector<double>& tried = others.terms[t].constants.back().tried;
    if (gate == of_size.end()) {
      others.left_out.insert(t);
    } else {
      tried = around(tried, gate->second);
    }
  }
  return {others};
}

std::vector<Others> same_regimes(const Missing& found, const Terms& terms, const Left& refuted, const Gates&) {
  std::map<std::string, std::set<double>> of_regimes;
  std::map<std::string, std::set<double>> of_steps;
  for (const FoundTerm& term : found.found) {
    const double last = term.constants.size() > 0 ? term.constants(term.constants.size() - 1) : 0.0;
    if (!term.regime.empty()) of_regimes[gate_of(term.location)].insert(last);
    if (term.family != "step" || !term.regime.empty() || !leaves_something(found)) continue;
    for (const char* sign : {">", "<="}) of_steps[fmt::format("where {} {} c", term.inputs.front(), sign)].insert(last);
  }
  if (of_regimes.empty() && of_steps.empty()) return {};
  Others others{terms, without(refuted, terms_of_regimes(terms))};
  for (std::size_t t = 0; t < terms.size(); ++t) {
    if (terms[t].regime.empty()) continue;
    std::vector<double>& tried = others.terms[t].constants.back().tried;
    std::set<double> all;
    const std::string gate = gate_of(terms[t].location);
    if (const auto own = of_regimes.find(gate); own != of_regimes.end()) {
      for (const double threshold : own->second) {
        for (const double near : around(tried, threshold)) all.insert(near);
      }
    } else if (const auto step = of_steps.find(gate); step != of_steps.end() && terms[t].family != "step") {
      constexpr std::size_t every = 3;  // thresholds are refined
      for (std::size_t k = 0; k < tried.size(); k += every) all.insert(tried[k]);
      all.insert(step->second.begin(), step->second.end());
    } else {
      others.left_out.insert(t);
      continue;
    }
    tried.assign(all.begin(), all.end());
  }
  return {others};
}

std::vector<Others> same_regimes_again(const Missing& found, const Terms& terms, const Left& refuted,
                                       const Gates& of_size) {
  return leaves_something(found) ? same_regimes(found, terms, refuted, of_size) : std::vector<Others>();
}

std::vector<Others> simpler_in_these_regimes(const Missing& found, const Terms& terms, const Left& refuted,
                                             const Gates& of_size) {
  Left laws;
  std::set<std::vector<std::string>> places;
  for (const FoundTerm& term : found.found) {
    if (term.regime.empty() || term.constants.size() < 2) continue;
    laws.insert(term.term);
    places.insert(term.inputs);
  }
  if (laws.empty()) return {};
  std::vector<Others> others = same_regimes(found, terms, refuted, of_size);
  others.push_back(others.front());
  others.front().left_out.insert(laws.begin(), laws.end());
  others.back().left_out = with_those(others.back().left_out, terms, [&](const ModelTerm& term) {
    return term.constants.size() > 1 && places.contains(term.inputs);
  });
  return others;
}

bool leaves_something(const Missing& missing) {
  constexpr double as_noise = 1.5;
  if (missing.answer == Answer::inner_state) return false;
  const auto is_known = [](const Gap& gap) { return !std::isnan(gap.known_noise); };
  const auto is_more = [](const Gap& gap) { return std::max(gap.after, gap.noise_floor) > as_noise * gap.known_noise; };
  if (std::ranges::any_of(missing.gaps, is_more)) return true;
  if (std::ranges::all_of(missing.gaps, is_known)) return false;
  if (missing.time.in_time && missing.time.independent_share < alike_in_neighbours) return true;
  return missing.answer == Answer::unknown || (missing.answer == Answer::undecided && missing.found.empty()) ||
         missing.answer == Answer::failed_held_out || !missing.structure.empty();
}

std::set<std::size_t> terms_of_regimes(const Terms& terms) {
  return with_those({}, terms, [](const ModelTerm& term) { return !term.regime.empty(); });
}

std::string gate_of(const std::string& location) {
  const std::size_t place = location.find("where ");
  return place == std::string::npos ? std::string() : location.substr(place);
}

}  // namespace llmt::discovery
