/// \file
/// Terms that a simulation lacks, in the words of a person.
#pragma once

#include <string>

#include "llmt/discovery/missing.hpp"

namespace llmt::report {

/// "step of load", "unknown: ..., on power".
std::string title_of(const discovery::FoundTerm& found, bool several_outputs);

/// "tau = 24.62 +- 0.98 minute".
std::string value_text(const discovery::TermValue& value);

/// The verdict in a phrase: "2 terms are missing".
/// How rows in time were used. `unit`: of their instants.
std::string time_text(const discovery::TimeUse& time, const std::string& unit);

std::string headline(const discovery::Missing& missing);

}  // namespace llmt::report
