/// \file
/// Several numbers at a time, the same bytes on every instruction set.
///
/// Vector types of the compiler, which makes of them what the machine has, and no fused multiply-add: sources that
/// include this are compiled with -ffp-contract=off.
#pragma once

#include <Eigen/Core>
#include <cstddef>

// Before a function: one of it per instruction set, chosen by the loader. Sanitizers do not get along with that.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define LLMT_FOR_EACH_INSTRUCTION_SET __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define LLMT_FOR_EACH_INSTRUCTION_SET
#endif

/// What such a function calls becomes part of it, and so of its instruction set.
#define LLMT_INLINE inline __attribute__((always_inline))

namespace llmt {

/// Eight doubles, aligned like one, so that any address will do.
using Lanes = double __attribute__((vector_size(64), aligned(8)));
inline constexpr Eigen::Index lanes = 8;

/// Four doubles; comparisons give masks, that choose by `mask ? a : b`.
using Quad = double __attribute__((vector_size(32)));
using QuadMask = decltype(Quad{} < Quad{});
constexpr Eigen::Index quad = 4;

/// `count` rounded up to whole quads.
constexpr Eigen::Index padded_to_quads(Eigen::Index count) { return (count + quad - 1) / quad * quad; }

/// From any address.
LLMT_INLINE Quad load_quad(const double* from) {
  using Anywhere = double __attribute__((vector_size(32), aligned(8), may_alias));
  return *reinterpret_cast<const Anywhere*>(from);
}

/// The first `count` (at least one) from any address, then zeros.
LLMT_INLINE Quad load_quad(const double* from, Eigen::Index count) {
  return count >= quad ? load_quad(from) : Quad{from[0], count > 1 ? from[1] : 0.0, count > 2 ? from[2] : 0.0, 0.0};
}

LLMT_INLINE double sum_of(Quad values) { return (values[0] + values[2]) + (values[1] + values[3]); }
LLMT_INLINE bool all_of(QuadMask mask) { return (mask[0] & mask[2] & mask[1] & mask[3]) != 0; }
LLMT_INLINE bool any_of(QuadMask mask) { return (mask[0] | mask[2] | mask[1] | mask[3]) != 0; }

}  // namespace llmt
