// Search and refit, round after round, on one set of poses.
#pragma once

#include <string>
#include <vector>

#include "discovery/question.hpp"
#include "llmt/robotics/calibration.hpp"

namespace llmt::robotics {

struct Investigation {
  Measurements searched;  ///< joint values moved by the maps there are
  Calibration baseline;   ///< without what was found
  Calibration fitted;     ///< with it
  std::vector<Hypothesis> found;
  discovery::Verdict verdict;
  EffectQuestion asked;
  int rounds = 0;

  void search(const DiscoveryOptions& options);
  void apply(const std::vector<Effect>& maps);
};

/// Adds joint maps to what was found if they lower the error on poses left out, then searches once more: an effect that
/// the maps cannot imitate may show only now.
void add_maps(Investigation& investigation, const DiscoveryOptions& options, Discovery& result);

/// Calls the progress callback, if there is one.
void say(const DiscoveryOptions& options, const std::string& stage);

/// Root of the sum of squared distances between model and measurement, mm.
double total_distance(const Robot& robot, const Measurements& measurements);

}  // namespace llmt::robotics
