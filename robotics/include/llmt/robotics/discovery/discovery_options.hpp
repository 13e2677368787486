/// \file
/// The options of a discovery.
///
///     DiscoveryOptions options;
///     options.held_out_share = 0.3;
///     options.progress = [](const llmt::ProgressReport& report) {
///       std::puts(report.step.c_str());
///       return true;  // false cancels the discovery
///     };
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "llmt/discovery/search.hpp"
#include "llmt/progress.hpp"
#include "llmt/robotics/calibration_options.hpp"
#include "llmt/robotics/effects.hpp"

namespace llmt::robotics {

struct DiscoveryOptions {
  std::vector<EffectType> catalogue = effect_types();
  CalibrationOptions calibration = {};
  discovery::SearchOptions search = {};
  /// Share of the poses that a second discovery does without, to state its error there. The names and the robot that is
  /// written are those of all poses. Not used where test measurements are given.
  double held_out_share = 0.2;
  bool scans = true;     ///< look for the orders of transmission errors and for the rows of knocks in the residuals
  bool patterns = true;  ///< try patterns without a physical cause; they carry the answer "unknown effect"
  bool maps = true;      ///< if the answer is unknown: add joint maps where they lower the error on poses left out
  bool correct = true;   ///< if the answer is unknown: add a correction by trees where it lowers that error further
  /// Relative standard deviation of the masses in the description. It is part of the standard errors of compliances and
  /// flexibilities, because the data determine only their products with the masses.
  double mass_uncertainty = 0.05;
  int rounds = 4;          ///< of search and nonlinear refit
  std::uint64_t seed = 1;  ///< deals the poses set aside; nothing else depends on it
  Progress progress = {};  ///< the steps are "calibrating", "searching, round 1", ...
};

}  // namespace llmt::robotics
