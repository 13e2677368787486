// What was found, fitted again without a fifth of the poses each.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "discovery/verification.hpp"

namespace llmt::robotics {

/// What the refits say of one name.
struct NameInRefits {
  int held = 0;  ///< refits in which a value is beyond two standard errors, of the same sign
  std::vector<std::array<double, 2>> ranges;  ///< smallest and largest value of each parameter
};

struct Refits {
  int count = 0;                    ///< 0: nothing was fitted again
  std::vector<NameInRefits> names;  ///< as Findings::names
};

/// Five refits of the robot with what was found, each without a fifth of the samples (repeats of a pose together) and
/// the outliers. None is made where nothing was found.
Refits refits_of(const Robots& robots, const PoseSplit& split, const Findings& found, const DiscoveryOptions& options);

/// Objection to names that do not hold in four of five refits.
std::optional<Objection> judge_refits(const Refits& refits);

}  // namespace llmt::robotics
