// The search of some poses: all of them, or those that are not set aside.
#pragma once

#include <functional>
#include <vector>

#include "calibration/joint_map_shift.hpp"
#include "discovery/investigation/pose_split.hpp"
#include "discovery/judges/findings.hpp"
#include "discovery/verification.hpp"
#include "llmt/robotics/discovery/discovery_options.hpp"

namespace llmt::robotics {

/// What it gives.
struct Searched {
  PoseSplit split;
  Unmapped plain;
  Findings found;
  std::vector<Objection> objections;
  Robots robots;
  discovery::LackOfFit lack_of_fit;
  bool once_each = false;  // repeats of a pose were averaged
  bool is_exact = false;   // the calibrated model leaves nothing; there are no findings
};

/// The arm as described, calibrated to the poses. Throws std::runtime_error where this leaves too few degrees of
/// freedom for a search, or misses by more than any effect does.
Investigation calibrated(const Robot& described, const Unmapped& plain, const DiscoveryOptions& options, Work& work);

/// Searches for effects. Joint maps are tried where something has no name: after a verdict "unknown", and after waves
/// that are no sines. The names are then those beside the maps.
Findings search_effects(Investigation start, const DiscoveryOptions& options);

/// Whether nothing was found, and nothing speaks against that.
bool is_all_clear(const Findings& found, const std::vector<Objection>& objections);

/// Calibrates, searches, judges and fits the poses that `split_with` does not set aside. Throws std::invalid_argument
/// if they are too few.
Searched searched_poses(const Robot& robot, const std::function<PoseSplit(Repeats)>& split_with,
                        const DiscoveryOptions& options, Work& work);

}  // namespace llmt::robotics
