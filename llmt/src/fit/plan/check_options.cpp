#include "fit/plan/check_options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "base/checks.hpp"
#include "growth/rules/rule.hpp"

namespace llmt {
namespace {

void require(bool condition, const char* option, double value, const char* bound) {
  if (!condition) {
    throw std::invalid_argument(fmt::format("llmt::fit: {} is {}, it must be {}", option, value, bound));
  }
}

void check_growth(const FitOptions& options, Eigen::Index inputs) {
  require(!std::isnan(options.significance), "significance", options.significance, "a number");
  require(options.min_leaf_samples >= 0, "min_leaf_samples", static_cast<double>(options.min_leaf_samples),
          "at least 0");
  require(options.max_leaves >= 0, "max_leaves", static_cast<double>(options.max_leaves), "at least 0");
  check_columns("llmt::fit", "split_inputs", options.split_inputs, inputs);
  check_columns("llmt::fit", "regression_inputs", options.regression_inputs, inputs);
}

void check_candidates(const ExpertOptions& expert) {
  for (const double width : expert.widths) {
    require(std::isfinite(width) && width > 0.0, "expert.widths", width, "finite and positive");
  }
  for (const double ridge : expert.ridges) {
    require(ridge >= 0.0 && std::isfinite(ridge), "expert.ridges", ridge, "finite and not negative");
  }
  for (const double shrinkage : expert.shrinkages) {
    require(shrinkage >= 0.0 && std::isfinite(shrinkage), "expert.shrinkages", shrinkage, "finite and not negative");
  }
  for (const double jump : expert.jumps) {
    require(jump >= 0.0, "expert.jumps", jump, "not negative");
  }
}

// What a growth rule does not go with.
void check_rule(const FitOptions& options) {
  const Rule& rule = rule_of(options.rule);
  if (std::ranges::find(rule.validities, options.validity) == rule.validities.end()) {
    std::vector<std::string_view> names;
    std::ranges::transform(rule.validities, std::back_inserter(names), name_of<ValidityChoice>);
    throw std::invalid_argument(fmt::format("llmt::fit: validity is {}, with rule {} it must be {}",
                                            name_of(options.validity), rule.name, fmt::join(names, " or ")));
  }
  if (!rule.has_own_models) return;
  const std::string none = fmt::format("0 with rule {}, which prunes and smooths its own local models", rule.name);
  for (const double shrinkage : options.expert.shrinkages) {
    require(shrinkage == 0.0, "expert.shrinkages", shrinkage, none.c_str());
  }
  if (options.pruning != Pruning::last_splits || options.terms != LocalTerms::linear ||
      options.sparse != SparseChoice::never) {
    throw std::invalid_argument(
        fmt::format("llmt::fit: pruning, terms and sparse must be as they are by default with rule {}, which has its "
                    "own local models and pruning",
                    rule.name));
  }
}

void check_sparse(const FitOptions& options) {
  if (options.sparse == SparseChoice::never) return;
  const bool always_overlap = rule_of(options.rule).overlapping == ValidityKind::gaussian;
  const bool crisp = options.validity == ValidityChoice::crisp && !always_overlap;
  if (options.expert.estimation == Estimation::as_grown && !crisp) {
    throw std::invalid_argument(
        fmt::format("llmt::fit: sparse is {}, it must be never where expert.estimation is as-grown, for those models "
                    "are full",
                    name_of(options.sparse)));
  }
  if (!options.trends.empty()) {
    throw std::invalid_argument(
        fmt::format("llmt::fit: sparse is {}, it must be never with trends", name_of(options.sparse)));
  }
}

}  // namespace

void check_options(const FitOptions& options, Eigen::Index inputs) {
  check_growth(options, inputs);
  check_candidates(options.expert);
  check_sparse(options);
  check_rule(options);
  require(options.max_threads >= 0, "max_threads", options.max_threads, "at least 0");
}

}  // namespace llmt
