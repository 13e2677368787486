/// \file
/// The memory that a fit of a sum will take.
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace llmt {

/// What the memory of a sum of trees depends on.
struct SumSize {
  Eigen::Index rows;
  Eigen::Index inputs;
  Eigen::Index outputs;
  Eigen::Index levels;  ///< of inputs that are categories, each of which is a feature
};

/// Estimate (N.4) of the memory in bytes that a fit takes at its peak beyond the caller's data
/// (docs/algorithms/numerics.md).
double estimated_memory(const SumSize& size);

/// Throws std::runtime_error, with the estimate and what makes it smaller, if it is more than `available` bytes.
void refuse_beyond_memory(const SumSize& size, std::uintmax_t available);

}  // namespace llmt
