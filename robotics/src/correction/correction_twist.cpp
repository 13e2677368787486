#include "correction/correction_twist.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <stdexcept>

namespace llmt::robotics {
namespace {

void check_inputs(const Correction& correction, const Chain& chain) {
  std::vector<std::string> inputs;
  bool numbers = true;
  for (const InputColumn& input : inputs_of(correction)) {
    inputs.push_back(input.name);
    numbers = numbers && !input.is_categorical();
  }
  const std::vector<std::string> joints = correction_inputs(chain);
  if (inputs == joints && numbers) return;
  throw std::invalid_argument(
      fmt::format("llmt::robotics: the correction has the inputs {}, robot \"{}\" needs the numbers {}, in this order",
                  fmt::join(inputs, ", "), chain.name, fmt::join(joints, ", ")));
}

}  // namespace

std::vector<std::string> correction_inputs(const Chain& chain) {
  std::vector<std::string> names;
  for (std::size_t j = 0; j < chain.joints.size(); ++j) {
    names.push_back(fmt::format("q{}_{}", j + 1, chain.joints[j].type == JointType::revolute ? "rad" : "mm"));
  }
  return names;
}

Eigen::Matrix3d base_rotation_of(const Chain& chain) {
  const Eigen::VectorXd any = Eigen::VectorXd::Zero(std::ssize(chain.joints));
  return Kinematics(chain).skeleton(any).base_rotation;
}

CorrectionTwist::CorrectionTwist(const Correction& correction, const Chain& chain) : correction_(correction) {
  check_inputs(correction, chain);
  for (const OutputColumn& output : outputs_of(correction)) {
    const auto found = std::ranges::find(correction_outputs, output.name);
    if (found == correction_outputs.end()) {
      throw std::invalid_argument(fmt::format("llmt::robotics: output \"{}\" of the correction is none of {}",
                                              output.name, fmt::join(correction_outputs, ", ")));
    }
    places_.push_back(found - correction_outputs.begin());
    if (std::ranges::count(places_, places_.back()) > 1) {
      throw std::invalid_argument(
          fmt::format("llmt::robotics: output \"{}\" of the correction is there twice", output.name));
    }
  }
}

Eigen::MatrixXd CorrectionTwist::at(const Eigen::MatrixXd& joints, int max_threads) const {
  Eigen::MatrixXd twist = Eigen::MatrixXd::Zero(joints.rows(), std::ssize(correction_outputs));
  const Eigen::MatrixXd predicted =
      std::visit([&](const auto& model) { return model.predict(joints, max_threads); }, correction_);
  for (std::size_t k = 0; k < places_.size(); ++k) {
    const OutputColumn& seen = outputs_of(correction_)[k];
    twist.col(places_[k]) = predicted.col(k).cwiseMax(seen.low).cwiseMin(seen.high);
  }
  return twist;
}

Pose moved(Pose pose, const Eigen::VectorXd& twist, const Eigen::Matrix3d& base, const Eigen::Vector3d& arm_mm) {
  const Eigen::Vector3d turn = base * twist.tail<3>();
  pose.position_mm += base * twist.head<3>() + turn.cross(arm_mm);
  const double angle = turn.norm();
  if (angle > 0.0) pose.rotation = Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix() * pose.rotation;
  return pose;
}

}  // namespace llmt::robotics
