#include "discovery/terms/approximations.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <utility>

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

}  // namespace

std::vector<std::string> sorted_inputs(const FoundTerm& found) {
  std::vector<std::string> inputs = found.inputs;
  std::ranges::sort(inputs);
  return inputs;
}

std::vector<bool> approximations(const std::vector<FoundTerm>& all, bool in_time) {
  // Terms of one input are counted by kinds, as there may be several steps. A product and a square times the other
  // input are as much of a power series in two inputs as the terms have.
  constexpr std::array<std::size_t, 2> too_many = {3, 2};
  std::map<Place, std::set<std::string>> kinds;
  std::set<Place> uncertain;
  for (const FoundTerm& found : all) {
    for (const Place& place : places_of(found, in_time)) {
      const std::vector<std::string>& inputs = place.first;
      if (in_time && inputs.size() == 1 && has_rival_of(found, inputs.front())) uncertain.insert(place);
      kinds[place].insert(inputs.size() == 1 ? kind_of(found) : found.family + " " + found.location);
    }
  }
  std::vector<bool> approximate;
  for (const FoundTerm& found : all) {
    approximate.push_back(std::ranges::any_of(places_of(found, in_time), [&](const Place& place) {
      return kinds[place].size() + (uncertain.contains(place) ? 1 : 0) >= too_many[place.first.size() - 1];
    }));
  }
  return approximate;
}

}  // namespace llmt::discovery
