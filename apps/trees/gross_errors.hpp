/// \file
/// Warnings of few rows that carry most of the held-out squared error: likely wrong targets.
#pragma once

#include "llmt/fit.hpp"
#include "trees/learning.hpp"

namespace llmt::apps {

/// Warns of such rows (report/fit/gross_errors.hpp) of all targets, unless the loss leaves them out anyway, with their
/// lines in the file.
void warn_of_gross_errors(const LearningArguments& arguments, const LearningTable& table, const FitResult& result);

}  // namespace llmt::apps
