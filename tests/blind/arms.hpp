/// \file
/// The three arms of the blind test, and what is wrong with every one that is built.
#pragma once

#include "blind/arm.hpp"
#include "llmt/random.hpp"

namespace blind {

/// "planar", "tx200" or "small6"; throws std::invalid_argument for another name.
Arm nominal_arm(const std::string& name);

/// What masses, payloads and elasticities suit an arm.
struct ArmScale {
  std::vector<double> payloads;                  ///< kg, the lighter and the heavier one
  double main_low = 0.0, main_high = 0.0;        ///< joint compliance of the main axes, rad/(N m)
  double wrist_low = 0.0, wrist_high = 0.0;      ///< of the wrist axes
  double bar_low = 0.0, bar_high = 0.0;          ///< 1/EI, 1/(N m^2)
  double torsion_low = 0.0, torsion_high = 0.0;  ///< 1/GJ, 1/(N m^2)
  double base_low = 0.0, base_high = 0.0;        ///< rad/(N m)
};
ArmScale scale_of(const std::string& name);

/// Log-uniform between two positive bounds.
double log_uniform(llmt::Random& random, double low, double high);

/// Either sign.
double sign(llmt::Random& random);

/// The arm that was built: lengths 0.2 ... 1 mm and angles 0.2 ... 2 mrad off, tool some mm, masses +-6 %, centres of
/// mass
/// +-15 mm unless `true_masses`, instrument somewhere. `described` gets the base that is roughly known, and gear
/// ratios.
Arm build(Arm& described, llmt::Random& random, bool true_masses);

}  // namespace blind
