// Options under which a claim about fits is tested: a list that grows by name.
#pragma once

#include <vector>

#include "llmt/fit.hpp"

namespace fit_cases {

struct Case {
  const char* name;
  llmt::FitOptions options = {};
};

/// Adds small trees with options that `change` sets.
template <class Change>
void add(std::vector<Case>& cases, const char* name, const Change& change) {
  cases.push_back({name, {.max_leaves = 6}});
  change(cases.back().options);
}

/// The default, every rule of growth, crisp, sparse, linear or quadratic terms, and Tukey's loss.
inline std::vector<Case> usual() {
  std::vector<Case> cases = {{"default"}};
  for (const llmt::Choice<llmt::GrowthRule>& rule : llmt::choices<llmt::GrowthRule>()) {
    add(cases, rule.name.data(), [&](llmt::FitOptions& options) { options.rule = rule.value; });
  }
  add(cases, "crisp", [](llmt::FitOptions& options) { options.validity = llmt::ValidityChoice::crisp; });
  add(cases, "sparse", [](llmt::FitOptions& options) { options.sparse = llmt::SparseChoice::automatic; });
  add(cases, "linear or quadratic", [](llmt::FitOptions& options) { options.terms = llmt::LocalTerms::automatic; });
  add(cases, "tukey", [](llmt::FitOptions& options) { options.loss = llmt::Loss::tukey; });
  return cases;
}

}  // namespace fit_cases
