/// \file
/// Effects that were found, in the words of a person.
#pragma once

#include <string>

#include "llmt/robotics/discovery_result.hpp"

namespace llmt::apps {

/// A value with its error in the unit that needs no exponent: 1.1e-6 rad/(N m) is 1.10 +- 0.05 urad/(N m).
std::string with_unit(double value, double error, const std::string& unit);

/// "joint2", "the whole arm".
std::string place_of(const robotics::FoundEffect& effect);

/// " (order 202)", or nothing.
std::string constants_of(const robotics::FoundEffect& effect);

}  // namespace llmt::apps
