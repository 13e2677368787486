/// \file
/// The result of a discovery.
///
///     const Discovery found = discover(robot, measured);
///     const bool is_named = found.answer == llmt::discovery::Answer::named;
///     const double gain_mm = found.held_out.before.mean - found.held_out.after.mean;
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "llmt/discovery/search.hpp"
#include "llmt/robotics/calibration_report.hpp"
#include "llmt/robotics/correction.hpp"
#include "llmt/statistics.hpp"

namespace llmt::robotics {

/// The appearance of an effect without a name.
struct ErrorPattern {
  std::string acts_on;                  ///< "joint2", "tool", "base"
  std::vector<std::string> depends_on;  ///< "q2", "temp_C"
  std::optional<double> per_turn;       ///< periods in a turn of the joint
  std::string kind;                     ///< "smooth", "bump at 35 deg", "step at -20 deg", ...
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
  std::vector<std::vector<Effect>> rival_effects;  ///< the rivals as effects that could stand in the robot
  bool exact_alias = false;  ///< a rival predicts the same at every pose: no measurement can distinguish them
  double share = 0.0;        ///< of the explained sum of squares
  /// Root mean square of the displacement that geometry and the other effects cannot imitate. It is never larger than
  /// the root mean square of what the calibrated robot misses.
  double rms_mm = 0.0;
  double family_rms_mm = 0.0;  ///< the same of all places of its family together
  /// Standard error of the effect's constant, where that was fitted: the order of a wave, a presliding.
  std::optional<double> constant_error = {};
  bool smaller = false;  ///< found beside larger ones, in what they leave
  /// Refits of everything that was found, each without a fifth of the poses; 0: none was made.
  int refits = 0;
  int held = 0;                               ///< those in which it is beyond two standard errors, of the same sign
  std::vector<std::array<double, 2>> ranges;  ///< smallest and largest value of each parameter in them
};

struct FoundPattern {
  ErrorPattern pattern;
  double share = 0.0;
};

/// An effect that would explain what is missing, but only at a size beyond what the catalogue calls plausible.
struct BeyondPlausible {
  Effect effect;
  std::string title;
  FoundParameter parameter;  ///< the one that is farthest beyond its limit
  double limit = 0.0;
};

/// The parts of the workspace in which the calibrated robot is wrong.
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

/// The smallest amplitude of an effect that would have been found with probability 0.9.
struct Visible {
  std::string what;
  double value = 0.0;
  std::string unit;
};

struct HeldOut {
  ErrorFigures before;  ///< of the robot as described, calibrated without the poses set aside
  ErrorFigures after;   ///< with what is found without them; test measurements: of Discovery::improved
  /// Error before minus error with what was found, reading by reading, mm. What was found is written if the mean is
  /// above 0.
  PairedDifference gain;
  double floor_mm = 0.0;  ///< mean distance between a perfect model and measurements with this noise
  bool floor_from_repeats = false;
  Eigen::Index poses = 0;
  std::vector<Eigen::Index> rows;  ///< of the measurements, from 0, that were set aside; none of test measurements
  Eigen::VectorXd before_mm;       ///< position errors of the readings set aside, in their order
  Eigen::VectorXd after_mm;
};

/// The answer in the words of a page for people. Answer, headline and FoundEffect::confirmed come from one table
/// (docs/discovery.md, "The answer").
enum class Headline {
  nothing_missing,
  named,
  named_with_rivals,        ///< other causes explain the data as well
  likely_causes,            ///< names explain what is missing, but none is confirmed
  likely_causes_unwritten,  ///< names explain the poses searched, but do not make the poses set aside better
  gross_errors,             ///< too many measurements fit nothing: neither an effect nor its absence can be told
  structured_residuals,     ///< no candidate explains the residuals, but they are not an instrument's noise
  named_in_part,            ///< beside a confirmed name something without a name is missing
  likely_causes_in_part,    ///< names, none of them confirmed, beside something without a name
  unknown,                  ///< something without a name is missing
};

struct Discovery {
  discovery::Answer answer = discovery::Answer::nothing_missing;
  Headline headline = Headline::nothing_missing;
  std::vector<FoundEffect> effects;
  /// Patterns of the part that the catalogue does not explain. Kind "noise": no candidate explains it, but no
  /// instrument scatters like that. Kind "outliers": more measurements fit nothing than can be told from an effect.
  std::vector<FoundPattern> unknown;
  std::vector<std::string> could_state;           ///< what the user could state to know more, in sentences
  std::vector<FoundPattern> more;                 ///< patterns that are left beside effects that were named
  std::vector<BeyondPlausible> beyond_plausible;  ///< one for each family
  std::vector<Effect> maps;                       ///< joint maps that were added for the unknown effect
  Robot before;                                   ///< calibrated without what was found
  CorrectedRobot improved;                        ///< with it, and with a correction of the rest where that helps
  bool withdrawn = false;                         ///< something was found, but `improved` is `before`: it was no better
  ErrorFigures fitted_before;                     ///< of the poses that were searched, without the outliers
  ErrorFigures fitted_after;
  HeldOut held_out;
  GapMap gap;                          ///< of `before`
  std::vector<Eigen::Index> outliers;  ///< rows of the measurements, from 0
  std::vector<StillJoint> still;       ///< joints that hardly moved
  std::vector<discovery::UntestableCause> not_testable;
  std::vector<Visible> visible;
  discovery::LackOfFit lack_of_fit;
  double noise_mm = 0.0;  ///< standard deviation of one coordinate
  double score_gain = 0.0;
  double threshold = 0.0;
  int hypotheses = 0;
  int rounds = 0;
  std::vector<std::string> notes;  ///< in sentences
};

}  // namespace llmt::robotics
