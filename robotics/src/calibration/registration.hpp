// The frames of a robot in closed form.
#pragma once

#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {

/// The robot with the base that Kabsch finds for its present tool. Needs x, y and z measured.
Robot with_closed_form_base(Robot robot, const Measurements& measurements);

/// The robot with the base in whose plane z = 0 its tool points lie best: total least squares.
Robot with_base_on_plane(Robot robot, const Measurements& measurements);

/// The robot with the tool point that fits its present base best: the mean of the measured points in the flange frame.
/// The tool's orientation stays. Needs positions x, y and z.
Robot with_closed_form_tool(Robot robot, const Measurements& measurements);

/// The robot with the tool's orientation that fits its present base best. Needs orientations.
Robot with_closed_form_orientation(Robot robot, const Measurements& measurements);

/// The robot with the base that measured distances from the origin of the world give: with p the tool point of a base
/// at the origin and t the base's translation, d^2 = |p|^2 + 2 p't + |t|^2 is linear in t and |t|^2. The base's
/// orientation stays. Distances that are all zero but for the same unknown length give the same base.
Robot with_base_by_distances(Robot robot, const Measurements& measurements);

}  // namespace llmt::robotics
