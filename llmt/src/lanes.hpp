/// \file
/// Vectors of eight doubles, and functions compiled for several instruction sets of which the loader takes the
/// machine's best. Sources that use them are compiled without fused multiply-add, so that bytes do not depend on the
/// machine.
#pragma once

#include <cstddef>

// Sanitizers do not get along with functions chosen by the loader.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define LLMT_FOR_EACH_INSTRUCTION_SET __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define LLMT_FOR_EACH_INSTRUCTION_SET
#endif
#define LLMT_ALWAYS_INLINE inline __attribute__((always_inline))

namespace llmt {

/// The compiler makes of it what the machine has. Aligned like a double, so that any address will do.
using Lanes = double __attribute__((vector_size(64), aligned(8)));

inline constexpr std::ptrdiff_t lanes = 8;

}  // namespace llmt
