/// \file
/// A comparison of methods as text and as JSON.
#pragma once

#include <string>

#include "llmt/compare.hpp"
#include "report/fit/fit_summary.hpp"

namespace llmt::report {

/// Every method with its errors, its size and its time, and which one is recommended. `run`: the rows and the options
/// that the methods share; `target`: the name of the output.
Json comparison_json(const FitRun& run, const std::string& target, const ComparisonResult& result);

/// The same for people. `width`: of the table.
std::string comparison_text(const FitRun& run, const std::string& target, const ComparisonResult& result,
                            std::size_t width = no_width_limit);

}  // namespace llmt::report
