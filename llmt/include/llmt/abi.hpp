#pragma once

#include <Eigen/Core>

/// \file
/// Turns an Eigen alignment mismatch between the library and its user into a link error.
///
/// Eigen's alignment follows the instruction set: `-mavx` makes it 32 bytes, plain x86-64 has 16. A program built with
/// other flags than the library then disagrees with it about where a matrix begins and how its memory is freed, and
/// crashes far from the cause. Here the two values are part of the name of a symbol that every including source refers
/// to and that the library defines for its own values only. Every public header that passes Eigen types includes this
/// file.

#define LLMT_ABI_JOIN(prefix, max, infix, fixed) prefix##max##infix##fixed
#define LLMT_ABI_NAME(max, fixed) \
  LLMT_ABI_JOIN(llmt_must_be_built_with_your_flags_EIGEN_MAX_ALIGN_BYTES_is_, max, _and_STATIC_, fixed)
#define LLMT_ABI_TAG LLMT_ABI_NAME(EIGEN_MAX_ALIGN_BYTES, EIGEN_MAX_STATIC_ALIGN_BYTES)

namespace llmt::abi {

extern const char LLMT_ABI_TAG;

// `used` keeps the otherwise unused reference at every optimisation level; one per source, because sources of one
// program can differ.
[[gnu::used]] static const char* const tag = &LLMT_ABI_TAG;

}  // namespace llmt::abi
