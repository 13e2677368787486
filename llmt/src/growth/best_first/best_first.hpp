/// \file
/// Best-first growth of one partition: RD, RETIS and residual analysis.
#pragma once

#include "growth/problem.hpp"

namespace llmt {

GrownPartition grow(const GrowthProblem& problem);

}  // namespace llmt
