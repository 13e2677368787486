// Rows of poses that share a base and a tool.
#pragma once

#include <vector>

#include "llmt/robotics/robot_types.hpp"

namespace llmt::robotics {

/// The robot as it stands in some rows: their base and tool are its chain's own, and there are no further ones.
struct Setting {
  Robot robot;
  Poses poses;
  std::vector<Eigen::Index> rows;
  Eigen::Index base = 0;     ///< where the parameters of its base begin among those of the whole robot
  Eigen::Index tool = 0;     ///< the same of its tool
  bool is_touched = false;   ///< whether its base is what the tool touches, see is_touched()
  double radius_mm = 0.0;    ///< that is taken off its distances: of a sphere whose radius is a parameter
  Eigen::Index radius = -1;  ///< where this parameter stands among those of the whole robot; -1: there is none
};

/// True if all rows use the chain's own base and tool, and there are no others. Throws std::invalid_argument if the
/// number of observations is not that of the rows.
bool is_one_setting(const Robot& robot, const Poses& poses);

/// The settings in the order of their first rows. Throws std::invalid_argument if the chain lacks a base or tool that
/// an observation names.
std::vector<Setting> settings_of(const Robot& robot, const Poses& poses);

/// Columns of the parameters of the whole robot at which those of a setting's robot stand.
std::vector<Eigen::Index> columns_of(const Setting& setting, const Robot& whole);

}  // namespace llmt::robotics
