// Measurements of a robot: what is read can be written, and reads back the same.
#include "llmt/robotics/measurements.hpp"

#include <stdexcept>

#include "fuzz/fuzz.hpp"

namespace fuzz_measurements {
namespace {

using namespace llmt::robotics;

Robot arm() {
  Robot robot;
  robot.chain.name = "arm";
  for (int j = 1; j <= 2; ++j) {
    Joint& joint = robot.chain.joints.emplace_back();
    joint.name = fmt::format("joint{}", j);
    joint.a_mm = 100.0 * j;
    joint.type = j == 2 ? JointType::prismatic : JointType::revolute;
  }
  robot.effects = {{.type = "formula", .at = "", .values = {0.1}, .formula = {"own", {{"z", "wind * q1"}}}}};
  return robot;
}

}  // namespace

FUZZ_TARGET(measurements) {
  static const Robot robot = arm();
  Measurements measurements;
  try {
    measurements = parse_measurements(fuzz::text_of(data, size), "d", robot);
  } catch (const std::runtime_error& error) {
    fuzz::require(std::string(error.what()).starts_with("d:"), fmt::format("'{}' names the file", error.what()));
    return 0;
  }
  try {
    validate(measurements, with_frames(robot, measurements.poses));
  } catch (const std::invalid_argument&) {
    return 0;  // a negative payload, for example
  }
  const Robot whole = with_frames(robot, measurements.poses);
  const std::string written = to_csv(measurements, whole);
  fuzz::require(to_csv(parse_measurements(written, "written", robot), whole) == written,
                "measurements survive writing");
  return 0;
}

}  // namespace fuzz_measurements
