/// \file
/// The memory that a fit will take.
#pragma once

#include <cstdint>

#include "fit/plan/defaults.hpp"

namespace llmt {

/// What the memory of a fit depends on.
struct FitSize {
  Eigen::Index rows;
  Eigen::Index inputs;
  Eigen::Index outputs;
  Eigen::Index coefficients;  ///< of a local model, with the constant
  Eigen::Index unknowns;      ///< of the largest joint system; 0 if none is solved
  Eigen::Index threads;       ///< that solve joint systems at the same time
};

/// The size of a fit of these rows by this plan. `leaves`: of the largest tree, 0 before it is known; `threads`: the
/// most that the fit may use.
FitSize size_of(const TrainingRows& all, const Plan& plan, Eigen::Index leaves, Eigen::Index folds,
                Eigen::Index threads);

/// Estimate (N.1) of the memory in bytes that a fit takes at its peak beyond the caller's data
/// (docs/algorithms/numerics.md).
double estimated_memory(const FitSize& size);

/// Throws std::runtime_error, with the estimate and what makes it smaller, if it is more than `available` bytes.
void refuse_beyond_memory(const FitSize& size, std::uintmax_t available);

}  // namespace llmt
