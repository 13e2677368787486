/// \file
/// The one hash of a row.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace llmt {

/// The hash of a row up to and including `value`, from that of the values before; 0 before the first. It is the same
/// for 0 and -0, and for all NaN, which stand for missing values.
///
/// One step of splitmix64 (Steele, Lea & Flood 2014).
inline std::uint64_t row_hash(std::uint64_t before, double value) {
  // Tables hold no infinity.
  const double key = std::isnan(value) ? std::numeric_limits<double>::infinity() : value + 0.0;  // -0 as 0
  std::uint64_t z = before + std::bit_cast<std::uint64_t>(key) + 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

}  // namespace llmt
