/// \file
/// Rates and tables over judged cases.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "blind/score_case.hpp"

namespace blind {

/// hits of total, with one-sided 95 % Clopper-Pearson bounds.
struct Rate {
  int hits = 0, total = 0;
  void add(bool hit) { hits += hit ? 1 : 0, ++total; }
  double upper() const;  ///< the rate is below it with 95 % confidence
  double lower() const;  ///< the rate is above it with 95 % confidence
  std::string text() const;
  nlohmann::ordered_json json() const;
};

using Group = std::vector<const Judged*>;

/// The cases that `wanted` accepts.
Group choose(const std::vector<Judged>& all, const std::function<bool(const Judged&)>& wanted);

/// Text for people; the same numbers go into `json`.
std::string report(const std::vector<Judged>& all, nlohmann::ordered_json& json);

}  // namespace blind
