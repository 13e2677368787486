/// \file
/// Which physical effect a robot model lacks: find the gap to the measurements, name it, add it, verify.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "llmt/discovery/search.hpp"
#include "llmt/robotics/calibration.hpp"
#include "llmt/robotics/calibration_report.hpp"
#include "llmt/robotics/correction.hpp"

namespace llmt::robotics {

struct DiscoveryOptions {
  std::vector<EffectType> catalogue = effect_types();
  CalibrationOptions calibration = {};
  discovery::SearchOptions search = {};
  double held_out_share =
      0.2;  ///< of the poses, set aside before anything is looked at, if no measurements for the test are given
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

/// What an unknown effect looks like.
struct Shape {
  std::string acts_on;                  ///< "joint2", "tool", "base"
  std::vector<std::string> depends_on;  ///< "q2", "temp_C"
  std::optional<double> per_turn;       ///< periods in a turn of the joint
  std::string kind;                     ///< "smooth", "bump at 35 deg", "step at -20 deg", ...
};

struct Untestable {
  std::string what;  ///< "backlash_approach@joint1", or the name of a type
  std::string why;
};

struct FoundParameter {
  std::string name;
  double value = 0.0;
  std::string unit;
  double standard_error = 0.0;
};

/// An effect that was found and added.
struct FoundEffect {
  Effect effect;
  std::string title;
  bool confirmed = false;
  std::vector<FoundParameter> parameters;
  std::vector<std::string> rivals;  ///< labels: "link_bending@joint2", joined by " + " where it takes several
  std::vector<std::vector<Effect>> rival_effects;  ///< the same, as effects that could stand in the robot
  bool exact_alias = false;                        ///< a rival predicts the same at every pose: no pose can tell
  double share = 0.0;                              ///< of the explained sum of squares
  double rms_mm = 0.0;                             ///< of the displacement that it causes beyond what geometry absorbs
};

struct FoundShape {
  Shape shape;
  double share = 0.0;
};

/// Where the gap is.
struct GapMap {
  struct Region {
    std::string conditions;  ///< "q2 > 35 deg and payload_kg > 5"
    Eigen::Index poses = 0;
    double mean_mm = 0.0;
  };
  std::vector<Region> regions;  ///< by falling error
  struct Share {
    std::string name;
    double share = 0.0;
  };
  std::vector<Share> acts_like;   ///< of the sum of squares along the motion by each joint; 1/3 by chance
  std::vector<Share> depends_on;  ///< importance of each input for the residual
};

/// Smallest amplitude that would have been found, 90 % of the time.
struct Visible {
  std::string what;
  double value = 0.0;
  std::string unit;
};

struct HeldOut {
  ErrorFigures before;    ///< calibrated as given
  ErrorFigures after;     ///< with what was found
  double floor_mm = 0.0;  ///< mean distance that the noise alone makes
  bool floor_from_repeats = false;
  Eigen::Index poses = 0;
};

struct Discovery {
  discovery::Answer answer = discovery::Answer::nothing_missing;
  std::vector<FoundEffect> effects;
  std::vector<FoundShape> unknown;
  std::vector<Effect> maps;    ///< free maps of the joints that were added for the unknown
  Robot before;                ///< calibrated without what was found
  CorrectedRobot improved;     ///< with it, and with a correction of the rest where that helps
  ErrorFigures fitted_before;  ///< of the poses that were searched
  ErrorFigures fitted_after;
  HeldOut held_out;
  GapMap gap;                          ///< of `before`
  std::vector<Eigen::Index> outliers;  ///< rows of the measurements, from 0
  std::vector<Untestable> not_testable;
  std::vector<Visible> visible;
  discovery::LackOfFit lack_of_fit;
  double noise_mm = 0.0;  ///< standard deviation of one coordinate
  double score_gain = 0.0;
  double threshold = 0.0;
  int hypotheses = 0;
  int rounds = 0;
  std::vector<std::string> notes;  ///< in sentences
};

/// Finds what is missing from the robot. `test`, or if it is empty a share of the measurements, takes no part until the
/// end, when it is used once. The improved robot is fitted to all of `measurements` but that share.
///
/// Throws as calibrate(), and std::invalid_argument if there are too few poses to leave any freedom.
Discovery discover(const Robot& robot, const Measurements& measurements, const std::optional<Measurements>& test = {},
                   const DiscoveryOptions& options = {});

}  // namespace llmt::robotics
