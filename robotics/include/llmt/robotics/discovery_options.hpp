/// \file
/// How a discovery goes about it.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "llmt/discovery/search.hpp"
#include "llmt/robotics/calibration_options.hpp"
#include "llmt/robotics/effects.hpp"

namespace llmt::robotics {

struct DiscoveryOptions {
  std::vector<EffectType> catalogue = effect_types();
  CalibrationOptions calibration = {};
  discovery::SearchOptions search = {};
  /// Share of the poses that is set aside before anything is looked at; not used where test measurements are given.
  double held_out_share = 0.2;
  bool scans = true;    ///< orders of transmission errors, rows of knocks
  bool shapes = true;   ///< hypotheses that carry "unknown"
  bool maps = true;     ///< free maps of the joints for what stays unknown, if they help on poses left out
  bool correct = true;  ///< a tree of what is left, if something unknown is and the tree helps on poses left out
  /// Standard deviation of the masses in the description, as a share: part of the standard errors of compliances and
  /// flexibilities, which the data know only as products with the masses.
  double mass_uncertainty = 0.05;
  int rounds = 4;  ///< of search and nonlinear refit
  std::uint64_t seed = 1;
  std::function<void(const std::string& stage)> progress = {};
};

}  // namespace llmt::robotics
