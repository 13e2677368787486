/// \file
/// How many cases of which kind a plan holds.
#pragma once

#include <string>
#include <vector>

#include "blind/case.hpp"

namespace blind {

/// The cases of a plan ("dev", "frozen" or "gate") for one arm, in a fixed order. Plans have seeds of their own: what a
/// tool was tuned on (dev) tells nothing about frozen. Throws std::invalid_argument for another name.
std::vector<Order> plan(const std::string& name, const std::string& arm);

}  // namespace blind
