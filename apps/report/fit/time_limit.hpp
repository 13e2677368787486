/// \file
/// What a time limit did to a fit, as a sentence and as JSON.
#pragma once

#include <string>

#include "llmt/time_limit.hpp"
#include "report/text/json.hpp"

namespace llmt::report {

/// What a time limit sets: of a tree its leaves, of a sum its rounds.
enum class LimitedSize { leaves, rounds };

/// "Time limit of 10 s: enough for 64 leaves of a tree at most; the same model again: --max-leaves 64".
std::string time_limit_text(const TimeLimit& time, LimitedSize size);

/// Seconds given and taken, whether the limit was reached, and the size: "max_leaves" or "max_rounds".
Json time_limit_json(const TimeLimit& time, LimitedSize size);

}  // namespace llmt::report
