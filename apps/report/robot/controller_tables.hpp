/// \file
/// The geometry of an arm as controllers load it.
#pragma once

#include <string>

#include "llmt/finding.hpp"
#include "llmt/robotics/chain.hpp"

namespace llmt::report {

/// YAML with the pose of each joint in the frame of the one before, at zero; m and rad.
std::string kinematics_yaml(const robotics::Chain& described);

/// CSV with the differences of the Denavit-Hartenberg parameters. Throws std::invalid_argument if convention or number
/// of joints differ.
std::string deltas_csv(const robotics::Chain& chain, const robotics::Chain& nominal);

/// What to say beside these tables of values that calibration could not determine alone, see uncertain_text().
Finding uncertain_values_warning(const std::string& uncertain);

}  // namespace llmt::report
