#include "llmt/robotics/correction.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <stdexcept>

#include "llmt/files.hpp"
#include "llmt/robotics/robot_file.hpp"

namespace llmt::robotics {
namespace {

const std::array<std::string, 3> output_names = {"dx_mm", "dy_mm", "dz_mm"};

Eigen::Matrix3d base_rotation(const Chain& chain) {
  const Eigen::VectorXd any = Eigen::VectorXd::Zero(std::ssize(chain.joints));
  return Kinematics(chain).skeleton(any).base_rotation;
}

std::vector<std::string> joint_names(const Chain& chain) {
  std::vector<std::string> names;
  for (std::size_t j = 0; j < chain.joints.size(); ++j) {
    names.push_back(fmt::format("q{}_{}", j + 1, chain.joints[j].type == JointType::revolute ? "rad" : "mm"));
  }
  return names;
}

void check_inputs(const Model& model, const Chain& chain) {
  std::vector<std::string> inputs;
  bool numbers = true;
  for (const InputColumn& input : model.inputs()) {
    inputs.push_back(input.name);
    numbers = numbers && !input.is_categorical();
  }
  const std::vector<std::string> joints = joint_names(chain);
  if (inputs == joints && numbers) return;
  throw std::invalid_argument(
      fmt::format("llmt::robotics: the correction has the inputs {}, robot \"{}\" needs the numbers {}, in this order",
                  fmt::join(inputs, ", "), chain.name, fmt::join(joints, ", ")));
}

std::vector<Eigen::Index> axes_of(const Model& model) {
  std::vector<Eigen::Index> axes;
  for (const OutputColumn& output : model.outputs()) {
    const auto found = std::ranges::find(output_names, output.name);
    if (found == output_names.end()) {
      throw std::invalid_argument(
          fmt::format("llmt::robotics: output \"{}\" of the correction is none of dx_mm, dy_mm, dz_mm", output.name));
    }
    axes.push_back(found - output_names.begin());
    if (std::ranges::count(axes, axes.back()) > 1) {
      throw std::invalid_argument(
          fmt::format("llmt::robotics: output \"{}\" of the correction is there twice", output.name));
    }
  }
  return axes;
}

}  // namespace

Eigen::MatrixXd residuals(const Robot& robot, const Measurements& measurements) {
  validate(measurements, robot);
  Eigen::MatrixXd world = measurements.positions_mm - positions(robot, measurements.poses);
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    if (!measurements.measured[axis]) world.col(axis).setZero();
  }
  return world * base_rotation(robot.chain);  // rows: r' R = (R' r)'
}

FitResult fit_correction(const Robot& robot, const Measurements& measurements, const FitOptions& options) {
  const Eigen::MatrixXd all = residuals(robot, measurements);
  std::vector<Eigen::Index> axes;
  std::vector<std::string> names;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    if (all.col(axis).isZero(0.0)) continue;
    axes.push_back(axis);
    names.push_back(output_names[axis]);
  }
  if (axes.empty()) throw std::invalid_argument("llmt::robotics::fit_correction: all residuals are zero");
  const Eigen::MatrixXd outputs = all(Eigen::all, axes);
  FitOptions of_numbers = options;
  of_numbers.choose_codes = false;  // joint positions that were measured on a grid are no names
  FitResult result = fit(measurements.poses.joints, outputs, of_numbers);
  result.model = result.model.named(joint_names(robot.chain), names);
  return result;
}

Eigen::MatrixXd positions(const CorrectedRobot& robot, const Poses& poses) {
  Eigen::MatrixXd points = positions(robot.robot, poses);
  if (!robot.correction) return points;
  const Model& model = *robot.correction;
  check_inputs(model, robot.robot.chain);
  const std::vector<Eigen::Index> axes = axes_of(model);
  Eigen::MatrixXd error = Eigen::MatrixXd::Zero(poses.count(), 3);
  const Eigen::MatrixXd predicted = model.predict(poses.joints);
  for (std::size_t k = 0; k < axes.size(); ++k) {
    const OutputColumn& seen = model.outputs()[k];
    error.col(axes[k]) = predicted.col(k).cwiseMax(seen.low).cwiseMin(seen.high);
  }
  points += error * base_rotation(robot.robot.chain).transpose();
  return points;
}

std::vector<Pose> tool_poses(const CorrectedRobot& robot, const Poses& poses) {
  std::vector<Pose> result = tool_poses(robot.robot, poses);
  const Eigen::MatrixXd points = positions(robot, poses);
  for (std::size_t i = 0; i < result.size(); ++i) result[i].position_mm = points.row(i).transpose();
  return result;
}

CorrectedRobot read_corrected_robot(const std::string& path, const UrdfLinks& links) {
  CorrectedRobot robot{.robot = read_robot(path, links), .correction = {}};
  if (robot.robot.correction_file.empty()) return robot;
  const std::filesystem::path model = std::filesystem::path(path).parent_path() / robot.robot.correction_file;
  const std::string text = read_file(model.string());
  // A description may name any file. What a message says of a file that is no model must not show what it holds.
  if (text.find("\"llmt-model\"") == std::string::npos) {
    throw std::runtime_error(fmt::format("{}: correction: {} is no model file", path, model.string()));
  }
  robot.correction = from_json(text, model.string());
  try {
    check_inputs(*robot.correction, robot.robot.chain);
    axes_of(*robot.correction);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(fmt::format("{}: {}", model.string(), error.what()));
  }
  return robot;
}

}  // namespace llmt::robotics
