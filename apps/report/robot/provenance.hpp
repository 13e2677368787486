/// \file
/// What a calibrated description was made from, for those who audit it.
#pragma once

#include <string>
#include <vector>

#include "llmt/robotics/robot_types.hpp"
#include "report/document/document.hpp"
#include "report/text/json.hpp"

namespace llmt::report {

/// The fields of robotics::Provenance under their names.
Json provenance_json(const robotics::Provenance& made);

/// The same read back. Throws Json::exception for what it does not write.
robotics::Provenance provenance_of(const Json& json);

/// A page's last section; nothing where the robot does not say.
std::vector<Section> provenance_section(const robotics::Robot& robot);

}  // namespace llmt::report
