/// \file
/// Arithmetic on several numbers at a time (SIMD) with the same bytes on every instruction set.
///
/// These are the compiler's vector types, which it translates into the instructions that the machine has. The bytes are
/// the same because all targets of this project are compiled with -ffp-contract=off, that is without fused
/// multiply-add.
#pragma once

#include <Eigen/Core>
#include <cstddef>

// Compiles the function once per instruction set and lets the loader pick one. Off under the address and the thread
// sanitizer, which do not support functions that the loader picks, and with clang 14, which does not have the
// attribute.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define LLMT_FOR_EACH_INSTRUCTION_SET __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define LLMT_FOR_EACH_INSTRUCTION_SET
#endif

/// Makes a function part of each function that calls it, so that it is compiled for the caller's instruction set.
#define LLMT_INLINE inline __attribute__((always_inline))

namespace llmt {

// Types of less alignment than their size are typedefs: clang ignores `aligned` in an alias (using).

/// Eight doubles with the alignment of one, so that they may be read from any address.
typedef double Lanes __attribute__((vector_size(64), aligned(8)));  // NOLINT(modernize-use-using)
static_assert(alignof(Lanes) == alignof(double));
inline constexpr Eigen::Index lanes = 8;

/// `count` rounded up to whole lanes.
constexpr Eigen::Index padded_to_lanes(Eigen::Index count) { return (count + lanes - 1) / lanes * lanes; }

/// Four doubles. A comparison of two quads is a mask; `mask ? a : b` chooses number by number.
using Quad = double __attribute__((vector_size(32)));
using QuadMask = decltype(Quad{} < Quad{});
constexpr Eigen::Index quad = 4;

/// `count` rounded up to whole quads.
constexpr Eigen::Index padded_to_quads(Eigen::Index count) { return (count + quad - 1) / quad * quad; }

/// Loads a quad from any address.
LLMT_INLINE Quad load_quad(const double* from) {
  typedef double Anywhere __attribute__((vector_size(32), aligned(8), may_alias));  // NOLINT(modernize-use-using)
  static_assert(alignof(Anywhere) == alignof(double));
  return *reinterpret_cast<const Anywhere*>(from);
}

/// Loads the first `count` numbers (at least one) of a quad from any address; the others are zero.
LLMT_INLINE Quad load_quad(const double* from, Eigen::Index count) {
  return count >= quad ? load_quad(from) : Quad{from[0], count > 1 ? from[1] : 0.0, count > 2 ? from[2] : 0.0, 0.0};
}

LLMT_INLINE double sum_of(Quad values) { return (values[0] + values[2]) + (values[1] + values[3]); }
LLMT_INLINE bool all_of(QuadMask mask) { return (mask[0] & mask[2] & mask[1] & mask[3]) != 0; }
LLMT_INLINE bool any_of(QuadMask mask) { return (mask[0] | mask[2] | mask[1] | mask[3]) != 0; }

}  // namespace llmt
