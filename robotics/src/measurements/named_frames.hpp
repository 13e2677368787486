// The frames of a calibrated robot that names in a table stand for.
#pragma once

#include <string>
#include <vector>

#include "llmt/csv.hpp"
#include "llmt/robotics/robot_types.hpp"

namespace llmt::robotics {

/// Names of frames have no dots: their parameters are called base@NAME.x.
std::string without_dots(std::string name);

/// Base and tool of each row by its words in the columns `session` and `target`, as Observation has them; none where
/// the robot has no names of sessions and targets. Throws std::runtime_error, naming file and line, for a name that it
/// does not have.
std::vector<Observation> known_frames(const Csv& csv, const Chain& chain, const std::vector<std::string>& sessions,
                                      const std::vector<std::string>& targets);

}  // namespace llmt::robotics
