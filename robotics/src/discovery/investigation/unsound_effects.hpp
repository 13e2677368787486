// Effects that a refit gave no meaning.
#pragma once

#include <vector>

#include "hypotheses/hypothesis.hpp"
#include "llmt/robotics/calibration.hpp"

namespace llmt::robotics {

/// Root of the sum of squared distances between model and measurement, mm.
double total_distance(const Robot& robot, const Measurements& measurements);

/// Displacements by an effect of the robot at the measured coordinates, mm, without what a change of the geometry that
/// its calibration freed could imitate.
Eigen::VectorXd beyond_geometry(const Robot& robot, const Effect& effect, const Measurements& measurements);

/// Effects that a refit gave no meaning. If the refit leaves more of the measurements `kept` than the baseline, or
/// something that is not finite, all of them. Else those of which a value is beyond its plausible limits by more than
/// two standard errors; a value that the poses do not determine must itself be within them. Effects without limits must
/// not move the tool twice as far, beyond what geometry can imitate, as the baseline misses the measurements, nor by a
/// fiftieth of the arm's reach, and have no value above 0.1 rad.
std::vector<Effect> unsound(const Calibration& baseline, const Calibration& fitted,
                            const std::vector<Hypothesis>& found, const Measurements& kept);

}  // namespace llmt::robotics
