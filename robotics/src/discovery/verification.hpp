// The robots before and after, and their errors on poses that took no part.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "discovery/investigation/pose_split.hpp"
#include "discovery/judges/findings.hpp"
#include "llmt/robotics/correction.hpp"
#include "llmt/statistics.hpp"

namespace llmt::robotics {

/// The robots that a discovery compares.
struct Robots {
  Robot before;              ///< calibrated without what was found
  CorrectedRobot improved;   ///< with it
  std::vector<Effect> maps;  ///< joint maps that were added
  std::vector<std::string> notes;
  bool is_worse = false;  ///< the refit with what was found missed more than `before` and was discarded
};

/// Both robots, fitted to the samples without the outliers of the search. `given` are the joint maps that the
/// description has. A refit that misses more is discarded. If the last search ended in an unknown effect,
/// a correction by trees is added where it helps.
Robots fit_robots(const Robot& robot, const Measurements& samples, const std::vector<Effect>& given,
                  const Findings& found, const DiscoveryOptions& options);

/// The same with nothing added to the calibrated robot.
Robots withdrawn(Robots robots);

/// Error of each reading set aside before minus with what was found, mm; nothing if fewer than three were set aside, or
/// nothing was found that could be written.
std::optional<PairedDifference> held_out_gain(const Robots& robots, const PoseSplit& split);

/// Objection to all names if the mean of the gain is not above 0. A gain within two
/// standard errors is no objection: the poses searched speak for the names, and those set aside do not speak against
/// them.
std::optional<Objection> judge_held_out_loss(const std::optional<PairedDifference>& gain, std::size_t names);

/// A sentence on poses set aside that are far off, such as lost beams, if there are any. They are not removed: no
/// choice depends on them.
std::optional<std::string> far_poses_note(const Robots& robots, const PoseSplit& split);

/// Position errors, mm, one of each position row.
Eigen::VectorXd position_errors(const CorrectedRobot& robot, const Measurements& measurements);
ErrorFigures figures(const CorrectedRobot& robot, const Measurements& measurements);

/// Errors of both robots on the poses set aside, along the axes that were fitted. `noise_mm` is the standard deviation
/// of one coordinate unless the repeats of `lack_of_fit` are enough to give it.
HeldOut verify(const Robots& robots, const PoseSplit& split, const discovery::LackOfFit& lack_of_fit, double noise_mm);

/// Writes the errors of `judged` on the poses set aside into the record of the calibration of `written`, for a later
/// check.
void remember_held_out_errors(const PoseSplit& split, const CorrectedRobot& judged, CorrectedRobot& written);

}  // namespace llmt::robotics
