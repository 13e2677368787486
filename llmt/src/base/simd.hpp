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
#define LLMT_HAS_INSTRUCTION_SETS
#define LLMT_FOR_EACH_INSTRUCTION_SET __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define LLMT_FOR_EACH_INSTRUCTION_SET
#endif

/// Makes a function part of each function that calls it, so that it is compiled for the caller's instruction set.
#define LLMT_INLINE inline __attribute__((always_inline))
/// LLMT_INLINE for a lambda; it stands behind the parameters.
#define LLMT_INLINE_LAMBDA __attribute__((always_inline))

namespace llmt {

/// Eight doubles, in registers of `register_bytes` each, with the alignment of a double, so that they may be read from
/// any address. The operators work number by number. GCC takes a vector that is wider than the processor's registers
/// apart through memory, so code with vectors of 64 bytes alone is about ten times slower where registers have 32.
template <int register_bytes>
struct Eight {
  // A typedef: clang ignores `aligned` in an alias (using).
  typedef double Register __attribute__((vector_size(register_bytes), aligned(8)));  // NOLINT(modernize-use-using)
  static constexpr int bytes = register_bytes;
  static constexpr int count = 64 / register_bytes;
  Register parts[count];

  LLMT_INLINE double operator[](int k) const { return parts[k / (register_bytes / 8)][k % (register_bytes / 8)]; }
  LLMT_INLINE Eight& operator+=(const Eight& b) {
    for (int k = 0; k < count; ++k) parts[k] += b.parts[k];
    return *this;
  }
  LLMT_INLINE Eight& operator-=(const Eight& b) {
    for (int k = 0; k < count; ++k) parts[k] -= b.parts[k];
    return *this;
  }
  LLMT_INLINE friend Eight operator*(const Eight& a, const Eight& b) {
    Eight result;
    for (int k = 0; k < count; ++k) result.parts[k] = a.parts[k] * b.parts[k];
    return result;
  }
  LLMT_INLINE friend Eight operator*(double a, const Eight& b) {
    Eight result;
    for (int k = 0; k < count; ++k) result.parts[k] = a * b.parts[k];
    return result;
  }
  LLMT_INLINE friend Eight operator/(double a, const Eight& b) {
    Eight result;
    for (int k = 0; k < count; ++k) result.parts[k] = a / b.parts[k];
    return result;
  }
  /// `chosen` where a > b, else 0.
  LLMT_INLINE friend Eight where_greater(const Eight& a, const Eight& b, const Eight& chosen) {
    Eight result;
    for (int k = 0; k < count; ++k) result.parts[k] = a.parts[k] > b.parts[k] ? chosen.parts[k] : Register{};
    return result;
  }
};
inline constexpr Eigen::Index lanes = 8;

#ifdef LLMT_HAS_INSTRUCTION_SETS
template <class Kernel>
__attribute__((target("avx512f"))) void with_512_bits(const Kernel& kernel) {
  kernel(Eight<64>{});
}
template <class Kernel>
__attribute__((target("avx2"))) void with_256_bits(const Kernel& kernel) {
  kernel(Eight<32>{});
}
#endif

/// Calls kernel(Eight<n>{}) with the widest registers that the processor has. The kernel is compiled for each of their
/// instruction sets if it is an LLMT_INLINE_LAMBDA and all that it calls is LLMT_INLINE.
template <class Kernel>
void with_widest_registers(const Kernel& kernel) {
#ifdef LLMT_HAS_INSTRUCTION_SETS
  if (__builtin_cpu_supports("avx512f") != 0) return with_512_bits(kernel);
  if (__builtin_cpu_supports("avx2") != 0) return with_256_bits(kernel);
#endif
  kernel(Eight<16>{});
}

/// `count` rounded up to whole lanes.
constexpr Eigen::Index padded_to_lanes(Eigen::Index count) { return (count + lanes - 1) / lanes * lanes; }

/// Four doubles. A comparison of two quads is a mask; `mask ? a : b` chooses number by number.
using Quad = double __attribute__((vector_size(32)));
using QuadMask = decltype(Quad{} < Quad{});
constexpr Eigen::Index quad = 4;

/// `count` rounded up to whole quads.
constexpr Eigen::Index padded_to_quads(Eigen::Index count) { return (count + quad - 1) / quad * quad; }

/// A quad at any address. A typedef: clang ignores `aligned` in an alias (using).
typedef double QuadAnywhere __attribute__((vector_size(32), aligned(8), may_alias));  // NOLINT(modernize-use-using)
static_assert(alignof(QuadAnywhere) == alignof(double));

/// Loads a quad from any address.
LLMT_INLINE Quad load_quad(const double* from) { return *reinterpret_cast<const QuadAnywhere*>(from); }

/// Adds to the four doubles at any address.
LLMT_INLINE void add_to_quad(double* to, Quad values) { *reinterpret_cast<QuadAnywhere*>(to) += values; }

/// Loads the first `count` numbers (at least one) of a quad from any address; the others are zero.
LLMT_INLINE Quad load_quad(const double* from, Eigen::Index count) {
  return count >= quad ? load_quad(from) : Quad{from[0], count > 1 ? from[1] : 0.0, count > 2 ? from[2] : 0.0, 0.0};
}

LLMT_INLINE double sum_of(Quad values) { return (values[0] + values[2]) + (values[1] + values[3]); }
LLMT_INLINE bool all_of(QuadMask mask) { return (mask[0] & mask[2] & mask[1] & mask[3]) != 0; }
LLMT_INLINE bool any_of(QuadMask mask) { return (mask[0] | mask[2] | mask[1] | mask[3]) != 0; }

}  // namespace llmt
