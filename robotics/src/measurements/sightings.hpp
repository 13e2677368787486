// The sightings in the rows of a table of measurements.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "llmt/csv.hpp"
#include "llmt/robotics/measurements.hpp"
#include "measurements/header.hpp"

namespace llmt::robotics {

/// One point or distance of a table, before rows of the table and readings are matched.
struct Sighting {
  Eigen::Index row = 0;
  std::string target;
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  std::string feature = {};  ///< "socket", "plane", "sphere" or "known sphere": `value` is then what is read of it
  bool is_length = false;  ///< `value` is the certified length from the feature in the column `from` to the tool point
};

/// All sightings, by row; of `measurements` sets `measured` and adds warnings. Throws std::runtime_error, naming file
/// and line.
std::vector<Sighting> sightings_of(const Csv& csv, const Header& header, Measurements& measurements);

}  // namespace llmt::robotics
