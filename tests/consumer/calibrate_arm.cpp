// Calibrates the sample arm from its measured positions and asks what its description lacks: two elastic joints.
#include <iostream>

#include "llmt/robotics/robotics.hpp"

int main() {
  using namespace llmt::robotics;
  const Robot robot = read_robot(SAMPLES "/arm.yaml");
  const Measurements measured = read_measurements(SAMPLES "/arm_measured.csv", robot);

  const CalibrationReport report = report_calibration(robot, measured);
  std::cout << "calibrated: " << report.geometric.held_out_mm.mean() << " mm on poses left out\n";

  const Discovery found = discover(robot, measured);
  for (const FoundEffect& effect : found.effects) {
    std::cout << effect.title << " at " << effect.effect.at << ": " << effect.parameters[0].value << ' '
              << effect.parameters[0].unit << '\n';
  }
  std::cout << "with it: " << found.held_out.after.mean << " mm on poses that took no part\n";
  const bool right = found.effects.size() == 2 && found.held_out.after.mean < 0.04;
  std::cout << (right ? "consumer ok" : "wrong answer") << '\n';
  return right ? 0 : 1;
}
