/// \file
/// Cases that share no size with the catalogue or with the plans of plan.hpp: arms, drives, carts and instruments as
/// data sheets and papers have them, several effects of different strength, gross errors, soft transitions.
#pragma once

#include <string>
#include <vector>

#include "blind/case.hpp"

namespace blind {

/// Which arm, and what is in the data: "none", "single", "soft_backlash", "unknown", "instrument", "several",
/// "gross_none" or "gross_single".
struct StrangerOrder {
  std::string arm, set;
  std::uint64_t seed = 0;
};

/// "scara2" (planar), "mini6" (offset wrist, small strain-wave gears), "big6" (cycloidal gears), "cobot6" (three
/// parallel axes), "arm7".
std::vector<std::string> stranger_arm_names();

/// Sizes in SI units, from data sheets; the sources stand with the numbers.
struct StrangerScale {
  std::vector<double> payloads;                  ///< kg
  double main_low = 0.0, main_high = 0.0;        ///< joint compliance before the wrist, rad/(N m)
  double wrist_low = 0.0, wrist_high = 0.0;      ///< of the wrist
  double bar_low = 0.0, bar_high = 0.0;          ///< 1/EI and 1/GJ, 1/(N m^2)
  double stand_low = 0.0, stand_high = 0.0;      ///< pedestal, cart or table, rad/(N m)
  double play_low = 0.0, play_high = 0.0;        ///< half width of backlash and hysteresis, rad
  double wave_low = 0.0, wave_high = 0.0;        ///< transmission error, amplitude, rad
  double encoder_low = 0.0, encoder_high = 0.0;  ///< eccentricity, amplitude, rad
};

Arm stranger_arm(const std::string& name);
StrangerScale stranger_scale(const std::string& name);

/// The arm as built, and the instrument some metres away at the origin of its own frame.
Arm build_stranger(Arm& described, llmt::Random& random);

/// What a stranger's effect is drawn for.
struct StrangerScene {
  const Arm& arm;
  const Pieces& pieces;
  const StrangerScale& scale;
  const Session& measured;
  llmt::Random& random;

  int pick(int low, int high) const {
    return low + static_cast<int>(random.below(static_cast<std::uint64_t>(high - low + 1)));
  }
  int moving_joint() const { return pick(0, arm.planar ? 1 : arm.size() - 2); }
};

std::vector<std::string> stranger_kinds(const Arm& arm);
Hidden draw_stranger(const std::string& kind, const StrangerScene& scene);

/// Everything of a case follows from its order.
Case make_stranger(const StrangerOrder& order);

/// The orders of a run: all arms and sets in turn.
std::vector<StrangerOrder> stranger_plan(int cases, std::uint64_t seed);

}  // namespace blind
