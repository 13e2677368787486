/// \file
/// A comparison of methods as a document and as JSON.
#pragma once

#include <string>

#include "llmt/compare.hpp"
#include "report/fit/fit_summary.hpp"

namespace llmt::report {

/// Every method with its errors, its size and its time, and which one is recommended. `run`: the rows and the options
/// that the methods share; `target`: the name of the output.
Json comparison_json(const FitRun& run, const std::string& target, const ComparisonResult& result);

/// The same for people, on a page and on a terminal.
Document comparison_report(const FitRun& run, const std::string& target, const ComparisonResult& result);

}  // namespace llmt::report
