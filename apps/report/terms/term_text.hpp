/// \file
/// Terms that a simulation lacks, in the words of a person.
#pragma once

#include <string>
#include <vector>

#include "llmt/discovery/missing.hpp"

namespace llmt::report {

/// "step of load", "unknown: ..., on power".
std::string title_of(const discovery::FoundTerm& found, bool several_outputs);

/// "tau = 24.62 +- 0.98 minute".
std::string value_text(const discovery::TermValue& value);

/// Whether the nominal value of a parameter is known: those of all its parts are.
bool has_nominal(const discovery::FittedParameter& fitted, const std::vector<std::string>& without_nominal);

/// The verdict in a phrase: "2 terms are missing".
std::string headline(const discovery::Missing& missing);

}  // namespace llmt::report
