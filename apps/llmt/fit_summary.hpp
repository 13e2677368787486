/// \file
/// What `llmt fit` says of a fit: as JSON and as text.
#pragma once

#include <string>

#include "llmt/fit.hpp"
#include "llmt/learning.hpp"
#include "shared/cli.hpp"

namespace llmt::apps {

/// What was fitted: its arguments, and the file it went to; empty: none.
struct FitRun {
  const LearningArguments& learning;
  const std::string& output;
};

Json summary_json(const FitRun& run, const FitResult& result);

void print_summary(const FitRun& run, const FitResult& result);

}  // namespace llmt::apps
