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
/// How rows in time were used. `column`: of their instants; empty: they are numbered.
std::string time_text(const discovery::TimeUse& time, const std::string& column);

std::string headline(const discovery::Missing& missing);

/// The same with the names: "2 terms are missing: step of load, settling of minute".
std::string headline_with_names(const discovery::Missing& missing);

/// How far the terms close the gap, in a sentence; empty if no rows were set aside or nothing was found.
std::string gap_sentence(const discovery::Missing& missing);

}  // namespace llmt::report
