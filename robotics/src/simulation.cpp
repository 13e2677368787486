#include "llmt/robotics/simulation.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "llmt/random.hpp"

namespace llmt::robotics {
namespace {

constexpr double radians = std::numbers::pi / 180.0;

std::array<double, 2> limits_of(const Joint& joint) {
  const bool turns = joint.type == JointType::revolute;
  if (!joint.limits && !turns) {
    throw std::invalid_argument(
        fmt::format("llmt::robotics::simulate: {} is prismatic and has no limits_mm", joint.name));
  }
  const std::array<double, 2> limits = joint.limits.value_or(std::array<double, 2>{-180.0, 180.0});
  const double unit = turns ? radians : 1.0;
  return {limits[0] * unit, limits[1] * unit};
}

Eigen::Index steps_within(const Joint& joint, double step_rad) {
  if (joint.type != JointType::revolute || !joint.limits) {
    throw std::invalid_argument(fmt::format("llmt::robotics::grid: {} must be revolute and have limits", joint.name));
  }
  const std::array<double, 2> limits = limits_of(joint);
  // A limit that is a multiple of the step belongs to the grid although rounding may put it a hair beyond.
  return static_cast<Eigen::Index>(std::floor((limits[1] - limits[0]) / step_rad + 1e-9)) + 1;
}

}  // namespace

Measurements simulate(const Robot& robot, const SimulationOptions& options) {
  validate(robot);
  if (options.poses < 1)
    throw std::invalid_argument(fmt::format("llmt::robotics::simulate: poses is {}, must be >= 1", options.poses));
  if (!(options.noise_um >= 0.0)) {
    throw std::invalid_argument(
        fmt::format("llmt::robotics::simulate: noise_um is {}, must be >= 0", options.noise_um));
  }
  Random random(options.seed);
  const std::vector<Joint>& joints = robot.chain.joints;
  Measurements measurements;
  measurements.poses.joints.resize(options.poses, std::ssize(joints));
  for (Eigen::Index i = 0; i < options.poses; ++i) {
    for (std::size_t j = 0; j < joints.size(); ++j) {
      const std::array<double, 2> limits = limits_of(joints[j]);
      measurements.poses.joints(i, static_cast<Eigen::Index>(j)) = random.uniform(limits[0], limits[1]);
    }
  }
  measurements.positions_mm = positions(robot, measurements.poses);
  for (Eigen::Index i = 0; i < options.poses; ++i) {
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      measurements.positions_mm(i, axis) += 1e-3 * options.noise_um * random.normal();
  }
  return measurements;
}

Poses grid(const Chain& chain, double step_rad) {
  if (!(step_rad > 0.0))
    throw std::invalid_argument(fmt::format("llmt::robotics::grid: step_rad is {}, must be > 0", step_rad));
  constexpr double largest_count = 1e7;
  double count = 1.0;
  for (const Joint& joint : chain.joints) count *= static_cast<double>(steps_within(joint, step_rad));
  if (count > largest_count)
    throw std::invalid_argument(fmt::format("llmt::robotics::grid: {} poses, at most {}", count, largest_count));
  Poses poses;
  poses.joints.resize(static_cast<Eigen::Index>(count), std::ssize(chain.joints));
  Eigen::Index repeats = 1;  // how long a joint holds its value: 1 for the last one
  for (std::size_t j = chain.joints.size(); j-- > 0;) {
    const Eigen::Index steps = steps_within(chain.joints[j], step_rad);
    const double lower = limits_of(chain.joints[j])[0];
    for (Eigen::Index i = 0; i < poses.count(); ++i) {
      poses.joints(i, static_cast<Eigen::Index>(j)) = lower + step_rad * static_cast<double>(i / repeats % steps);
    }
    repeats *= steps;
  }
  return poses;
}

}  // namespace llmt::robotics
