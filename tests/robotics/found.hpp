// Effects and what a discovery found, in one line each.
#pragma once

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "llmt/robotics/discovery/discovery.hpp"

namespace llmt::robotics {

inline Effect effect(const std::string& type, const std::string& at, std::vector<double> values,
                     std::vector<double> constants = {}) {
  return {.type = type, .at = at, .values = std::move(values), .constants = std::move(constants)};
}

/// Of all effects that were found, sorted.
inline std::vector<std::string> labels(const Discovery& found) {
  std::vector<std::string> all;
  for (const FoundEffect& one : found.effects) all.push_back(effect_label(one.effect));
  std::ranges::sort(all);
  return all;
}

}  // namespace llmt::robotics
