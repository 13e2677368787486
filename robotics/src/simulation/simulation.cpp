#include "llmt/robotics/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <stdexcept>
#include <vector>

#include "kinematics/mimics.hpp"
#include "kinematics/units.hpp"
#include "llmt/random.hpp"
#include "robot/robot_evaluator.hpp"

namespace llmt::robotics {
namespace {

constexpr Eigen::Index most_simulated = 1000000;
constexpr double largest_noise_um = 1e12;

Eigen::Index steps_within(const Joint& joint, double step_rad) {
  if (joint.type != JointType::revolute || !joint.limits) {
    throw std::invalid_argument(fmt::format("llmt::robotics::grid: {} must be revolute and have limits", joint.name));
  }
  const double range_rad = radians * ((*joint.limits)[1] - (*joint.limits)[0]);
  // A limit that is a multiple of the step belongs to the grid although rounding may put it a hair beyond.
  return static_cast<Eigen::Index>(std::floor(range_rad / step_rad + 1e-9)) + 1;
}

// The first number in the name of a column: 3 in "tau3_Nm"; 0 if there is none.
std::size_t number_in(const std::string& name) {
  const std::size_t at = name.find_first_of("0123456789");
  return at == std::string::npos ? 0 : static_cast<std::size_t>(std::strtoul(name.c_str() + at, nullptr, 10));
}

// The column to make of "a|b": order rather than time, and the unit that suits the joint.
std::string chosen_column(const std::string& names, const Chain& chain) {
  const std::size_t bar = names.find('|');
  if (bar == std::string::npos) return names;
  if (names.find("order") != std::string::npos) return "order";
  const std::size_t joint = number_in(names) - 1;
  const bool slides = chain.joints.at(joint).type == JointType::prismatic;
  return slides ? names.substr(bar + 1) : names.substr(0, bar);
}

double reference_temperature(const Effect& effect) {
  const EffectType& type = effect_type(effect.type);
  for (std::size_t k = 0; k < type.constants.size(); ++k) {
    if (type.constants[k].name == "reference") return effect.constants[k];
  }
  return 20.0;
}

Eigen::VectorXd gravity_torque(const Robot& robot, const Poses& poses, std::size_t joint) {
  // Only what changes payload or gravity matters; the others might want the very column that is being made.
  Robot loaded = robot;
  std::erase_if(loaded.effects, [](const Effect& effect) { return !effect_type(effect.type).adjust; });
  return gravity_loads(loaded, poses).col(joint);
}

Eigen::VectorXd neutral_values(const std::string& name, const Effect& effect, const Robot& robot, const Poses& poses,
                               Random& random) {
  Eigen::VectorXd values = Eigen::VectorXd::Zero(poses.count());
  const std::size_t number = number_in(name);
  const bool is_of_joint = number >= 1 && number <= robot.chain.joints.size();
  if (name == "order" || name == "time_s") {
    for (Eigen::Index i = 0; i < values.size(); ++i) values(i) = static_cast<double>(i);
  } else if (name.starts_with("temp")) {
    values.setConstant(reference_temperature(effect));
  } else if (name == "payload_kg") {
    values.setConstant(robot.chain.payload.mass_kg);
  } else if (name.starts_with("dir")) {
    for (double& value : values) value = random.uniform(-1.0, 1.0) < 0.0 ? -1.0 : 1.0;
  } else if (name.starts_with("tau") && is_of_joint) {
    values = gravity_torque(robot, poses, number - 1);
  } else if (name.starts_with("qmeas") && is_of_joint) {
    values = poses.joints.col(number - 1);
  }
  return values;
}

Measurements measured(const Robot& robot, Poses poses, const SimulationOptions& options, Random& random) {
  if (!(options.noise_um >= 0.0 && options.noise_um <= largest_noise_um)) {
    throw std::invalid_argument(fmt::format("llmt::robotics::simulate: noise_um is {}, must be between 0 and {}",
                                            options.noise_um, largest_noise_um));
  }
  Measurements measurements;
  measurements.poses = with_needed_columns(robot, std::move(poses), options.seed);
  const Eigen::Index count = measurements.poses.count();
  measurements.positions_mm.resize(count, 3);
  Work work(options.progress);
  constexpr Eigen::Index block = 20000;  // between blocks the work may be stopped
  for (Eigen::Index first = 0; first < count; first += block) {
    std::vector<Eigen::Index> rows(std::min(block, count - first));
    std::iota(rows.begin(), rows.end(), first);
    measurements.positions_mm.middleRows(first, std::ssize(rows)) = positions(robot, select(measurements.poses, rows));
    work.did(static_cast<double>(rows.size()) / static_cast<double>(count));
  }
  if (!(measurements.positions_mm.array().abs() <= farthest_mm).all()) {
    throw std::runtime_error(position_refusal(robot, measurements.poses));
  }
  for (Eigen::Index i = 0; i < measurements.count(); ++i) {
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      measurements.positions_mm(i, axis) += 1e-3 * options.noise_um * random.normal();
  }
  work.finish();
  return measurements;
}

}  // namespace

Measurements simulate(const Robot& robot, const SimulationOptions& options) {
  validate(robot);
  if (options.poses < 1 || options.poses > most_simulated) {
    throw std::invalid_argument(
        fmt::format("llmt::robotics::simulate: poses is {}, must be between 1 and {}", options.poses, most_simulated));
  }
  Random random(options.seed);
  const std::vector<Joint>& joints = robot.chain.joints;
  Poses poses;
  poses.joints.resize(options.poses, std::ssize(joints));
  const auto [low, high] = joint_ranges(robot.chain, "llmt::robotics::simulate");
  for (Eigen::Index i = 0; i < options.poses; ++i) {
    for (std::size_t j = 0; j < joints.size(); ++j) {
      if (!joints[j].mimic) poses.joints(i, j) = random.uniform(low(j), high(j));
    }
  }
  poses.joints = with_mimics(robot.chain, std::move(poses.joints));
  return measured(robot, std::move(poses), options, random);
}

Measurements simulate(const Robot& robot, Poses poses, const SimulationOptions& options) {
  validate(robot);
  Random random(options.seed + 0xbf58476d1ce4e5b9U);  // not the stream that poses of the same seed were drawn from
  return measured(robot, std::move(poses), options, random);
}

Poses with_needed_columns(const Robot& robot, Poses poses, std::uint64_t seed) {
  Random random(seed + 0x9e3779b97f4a7c15U);  // not the stream of the poses
  for (const Effect& effect : robot.effects) {
    for (const std::string& names : effect_columns(robot.chain, effect)) {
      if (find_column(poses, names) != nullptr) continue;
      const std::string name = chosen_column(names, robot.chain);
      if (is_move(name)) {
        if (find_column(poses, "order|time_s") == nullptr) {
          poses.covariates["order"] = neutral_values("order", effect, robot, poses, random);
        }
        add_moves(poses, robot.chain);
      } else {
        poses.covariates[name] = neutral_values(name, effect, robot, poses, random);
      }
    }
  }
  return poses;
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
    const double lower = radians * (*chain.joints[j].limits)[0];
    for (Eigen::Index i = 0; i < poses.count(); ++i) {
      poses.joints(i, j) = lower + step_rad * static_cast<double>(i / repeats % steps);
    }
    repeats *= steps;
  }
  return poses;
}

}  // namespace llmt::robotics
