#include "discovery/least_squares/check.hpp"

#include <fmt/format.h>

#include <cmath>
#include <set>
#include <stdexcept>

namespace llmt::discovery {

void refuse_to_solve(const std::string& message) { throw std::invalid_argument("llmt::discovery::solve: " + message); }

void check(const SolverOptions& options) {
  const auto must = [](const char* field, double value, bool good, const char* bound) {
    if (!good) refuse_to_solve(fmt::format("SolverOptions::{} is {}, must be {}", field, value, bound));
  };
  must("damping", options.damping, options.damping >= 0.0 && std::isfinite(options.damping), ">= 0 and finite");
  must("max_iterations", options.max_iterations, options.max_iterations >= 0, ">= 0");
  must("gradient_tolerance", options.gradient_tolerance, options.gradient_tolerance >= 0.0, ">= 0");
  must("step_tolerance", options.step_tolerance, options.step_tolerance >= 0.0, ">= 0");
  must("rank_tolerance", options.rank_tolerance, options.rank_tolerance > 0.0 && options.rank_tolerance < 1.0,
       "between 0 and 1");
}

void check(const std::vector<Parameter>& parameters) {
  std::set<std::string> names;
  for (const Parameter& p : parameters) {
    if (p.name.empty()) refuse_to_solve("a parameter has no name");
    if (!names.insert(p.name).second) refuse_to_solve(fmt::format("parameter \"{}\" is there twice", p.name));
    if (!std::isfinite(p.value))
      refuse_to_solve(fmt::format("parameter \"{}\": value is {}, must be finite", p.name, p.value));
    if (!(p.scale > 0.0) || !std::isfinite(p.scale)) {
      refuse_to_solve(fmt::format("parameter \"{}\": scale is {}, must be > 0 and finite", p.name, p.scale));
    }
    if (p.prior_sigma && !(*p.prior_sigma > 0.0)) {
      refuse_to_solve(fmt::format("parameter \"{}\": prior_sigma is {}, must be > 0", p.name, *p.prior_sigma));
    }
    if (p.prior_value && !std::isfinite(*p.prior_value)) {
      refuse_to_solve(fmt::format("parameter \"{}\": prior_value is {}, must be finite", p.name, *p.prior_value));
    }
  }
}

}  // namespace llmt::discovery
