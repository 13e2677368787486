/// \file
/// Random numbers that are the same on every platform.
///
/// The C++ standard fixes the engines but not the distributions, so the same seed gives different data with the
/// standard library of another vendor. Here both are fixed: the engine xoshiro256** (Blackman & Vigna 2018), seeded by
/// splitmix64, and the distributions below.
///
///     llmt::Random random(1);
///     const double noise = 0.1 * random.normal();
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "llmt/abi.hpp"

namespace llmt {

/// A stream of pseudo-random numbers. A value type: a copy continues the same sequence on its own.
class Random {
 public:
  /// Every seed, 0 included, starts a well-mixed sequence.
  explicit Random(std::uint64_t seed);

  /// 64 uniformly distributed bits.
  std::uint64_t bits();

  /// Uniform on [0, 1), a multiple of 2^-53.
  double uniform();

  /// Uniform on [low, high).
  double uniform(double low, double high);

  /// Uniform on {0, ..., bound - 1}, without modulo bias. Throws std::invalid_argument if bound is 0.
  std::uint64_t below(std::uint64_t bound);

  /// Standard normal (Marsaglia's polar method).
  double normal();

  /// The numbers 0 ... size-1 in random order (Fisher-Yates).
  std::vector<Eigen::Index> permutation(Eigen::Index size);

 private:
  std::array<std::uint64_t, 4> state_;
  double spare_normal_ = 0.0;
  bool has_spare_ = false;
};

}  // namespace llmt
