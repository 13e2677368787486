/// \file
/// Poses to measure next, so that an ambiguous answer becomes a unique one.
///
///     const Discrimination telling = discriminating_poses(robot, 0, rival, measured.poses, 0.03);
///     for (const DiscriminatingPose& pose : telling.poses) std::printf("%g mm\n", pose.disagreement_mm);
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/robotics/robot.hpp"

namespace llmt::robotics {

/// A pose at which two explanations predict different tool positions.
struct DiscriminatingPose {
  Eigen::VectorXd joints;   ///< J: rad, mm for prismatic joints
  double payload_kg = 0.0;  ///< to be carried there
  /// Distance between the predictions, mm, after the rival has been fitted to this pose and those before it too.
  double disagreement_mm = 0.0;
  /// The other columns that the effects in question look at, as in one of the measured poses: "temp_C", "dir2", ...
  std::map<std::string, double> conditions;
};

/// Poses to measure next.
struct Discrimination {
  std::vector<DiscriminatingPose>
      poses;                   ///< by falling criterion; fewer than asked for where further poses add nothing
  bool payload_helps = false;  ///< some of them carry a payload that was not measured
  double noise_mm = 0.0;       ///< standard deviation of one coordinate, to compare a disagreement with
  bool none_can = false;       ///< the predictions differ nowhere by more than the noise; `poses` is empty
};

/// Poses at which the effect that was found and a rival disagree most, found greedily among some hundred random ones
/// within the joint limits (T-optimal design: Atkinson & Fedorov 1975, Biometrika 62, 57-70). Predictions are to first
/// order:
///
///     y_f(x) = signature of the effect times its values, mm
///     X_g(x) = derivatives by geometry, by the robot's other effects (not its maps) and by the rival's values
///     b_g    = argmin |y_f - X_g b|^2 over the measured poses and those chosen so far
///     next   = argmax e' (1 + X_g(x) A^-1 X_g(x)')^-1 e,   e = y_f(x) - X_g(x) b_g,   A = sum of X_g' X_g
///
/// The criterion is the growth of the smallest sum of squares by the new pose when the rival is fitted to it too.
/// Payloads are those measured, 0, and the description's; the criterion of a payload that was not measured must be 20 %
/// larger. Other columns are taken from a random measured pose, except that tauN_Nm becomes the torque of gravity and
/// qmeasN keeps its distance from the joint value. The rival's values are not held to their plausible limits.
/// Collisions and the field of view of the instrument are not checked.
///
/// `fitted` holds what was found, `effect` is its place in fitted.effects; `rival` are the effects that would stand in
/// its place; `measured_axes` are the coordinates x, y, z that the instrument sees; `noise_mm` is the standard
/// deviation of one of them. Joints without limits: +-180 deg, or the measured range of a prismatic one.
///
/// Throws std::invalid_argument if there is no such effect, no measured pose, count < 1, noise that is negative or not
/// finite, no measured axis, and as effect_signatures().
Discrimination discriminating_poses(const Robot& fitted, std::size_t effect, const std::vector<Effect>& rival,
                                    const Poses& measured, double noise_mm, int count = 5, std::uint64_t seed = 1,
                                    const std::array<bool, 3>& measured_axes = {true, true, true});

}  // namespace llmt::robotics
