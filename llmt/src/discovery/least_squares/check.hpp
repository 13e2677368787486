// What solve() refuses.
#pragma once

#include <string>
#include <vector>

#include "llmt/discovery/problem.hpp"

namespace llmt::discovery {

/// Throws std::invalid_argument.
[[noreturn]] void refuse_to_solve(const std::string& message);

/// Throws std::invalid_argument naming the option, its value and its bound.
void check(const SolverOptions& options);

/// Throws std::invalid_argument naming the parameter: empty or repeated names, numbers that are not finite, scales or
/// prior standard deviations that are not positive.
void check(const std::vector<Parameter>& parameters);

}  // namespace llmt::discovery
