// What a description says of its calibration.
#pragma once

#include "llmt/robotics/robot_types.hpp"
#include "yaml/yaml_reader.hpp"
#include "yaml/yaml_writer.hpp"

namespace llmt::robotics {

/// The map `calibration` of a robot whose chain and identified parameters have been read.
CalibrationRecord read_record(YamlMap map, const Robot& robot);

void write_record(YamlWriter& out, const Chain& chain, const CalibrationRecord& record);

}  // namespace llmt::robotics
