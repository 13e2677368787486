// The meaning of a correction's outputs.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "llmt/robotics/correction_model.hpp"
#include "llmt/robotics/kinematics.hpp"

namespace llmt::robotics {

/// dx_mm, dy_mm, dz_mm of the tool point and the rotation vector drx_rad, dry_rad, drz_rad, in the base frame.
inline const std::array<std::string, 6> correction_outputs = {"dx_mm",   "dy_mm",   "dz_mm",
                                                              "drx_rad", "dry_rad", "drz_rad"};

/// A correction model, checked, for a chain.
class CorrectionTwist {
 public:
  /// Throws std::invalid_argument if the inputs are not the chain's joints, or an output is none of
  /// correction_outputs or there twice.
  CorrectionTwist(const Correction& correction, const Chain& chain);

  /// Places of the model's outputs in correction_outputs.
  const std::vector<std::size_t>& places() const { return places_; }

  /// The model's outputs at each row of joint values, n x 6, every component clamped to the range seen in training.
  Eigen::MatrixXd at(const Eigen::MatrixXd& joints, int max_threads = 0) const;

 private:
  const Correction& correction_;
  std::vector<std::size_t> places_;
};

/// A pose moved by a row of CorrectionTwist::at(). `base` is R_world_base; `arm_mm` leads from the tool point that the
/// correction was learnt at to that of the pose, in the world frame.
Pose moved(Pose pose, const Eigen::VectorXd& twist, const Eigen::Matrix3d& base, const Eigen::Vector3d& arm_mm);

/// The names that inputs of a correction have: q1_rad, q2_mm, ...
std::vector<std::string> correction_inputs(const Chain& chain);

Eigen::Matrix3d base_rotation_of(const Chain& chain);

}  // namespace llmt::robotics
