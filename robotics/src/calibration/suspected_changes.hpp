// Descriptions and tables as they may have been meant: what goes wrong in files.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {

/// One mistake, undone.
struct Change {
  std::string name;  ///< as --accept-suspicion takes it, "joint5_radians"
  std::string words;
  std::function<void(Measurements&)> make;
  std::function<void(Chain&)> describe = {};  ///< empty: the description is right
};

/// Units of angles, of positions, of the description and of one target's points; an axis of the instrument; signs,
/// zeros, order and coupling of the joints; the convention of the description.
std::vector<Change> single_changes(const Chain& chain, const Poses& poses);

/// Every choice of two joints or more that count in the other direction, of an arm of at most seven.
std::vector<Change> sign_patterns(const Chain& chain);

}  // namespace llmt::robotics
