#include "llmt/robotics/correction.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <filesystem>
#include <map>
#include <stdexcept>
#include <utility>

#include "correction/correction_twist.hpp"
#include "kinematics/rotations.hpp"
#include "llmt/files.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "robot/chart.hpp"

namespace llmt::robotics {
namespace {

// Residuals of readings at one stand of the arm, brought to the point of the chain's own tool.
struct Stands {
  Eigen::MatrixXd joints;           // n x J
  Eigen::MatrixXd twists;           // n x 6 as CorrectionTwist::at()
  std::vector<double> labels = {};  // pose_labels() of them
};

// The vector from the tool point of the chain's own tool to that of every row, in the world frame, mm.
Eigen::MatrixXd arms_of(const Robot& robot, const Poses& poses) {
  Poses own = poses;
  for (Observation& seen : own.observations) seen = {.base = seen.base};
  Poses all = poses;
  for (Observation& seen : all.observations) seen.reading = Reading::position;
  return positions(robot, all) - positions(robot, own);
}

Eigen::Matrix3d base_rotation_of(const Chain& chain, const std::string& base) {
  Chain own = chain;
  const auto found = std::ranges::find(chain.bases, base, &NamedFrame::name);
  if (found != chain.bases.end()) own.base = found->frame;
  return base_rotation_of(own);
}

// The twist (d, r) of least squares that explains the residuals of the rows of one stand: that of a point is
// d + r x arm, that of an orientation r. Coordinates that were not measured take no part.
Eigen::VectorXd twist_of(const Robot& robot, const Measurements& measurements, const Eigen::MatrixXd& errors,
                         const Eigen::MatrixXd& arms, const std::vector<Eigen::Index>& rows) {
  constexpr double lever_mm = 300.0;  // makes lengths of angles
  Eigen::MatrixXd equations = Eigen::MatrixXd::Zero(3 * std::ssize(rows), 6);
  Eigen::VectorXd right(equations.rows());
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const Observation& seen = measurements.poses.observations[rows[k]];
    const Eigen::Matrix3d base = base_rotation_of(robot.chain, seen.base);
    auto block = equations.middleRows(3 * k, 3);
    if (seen.reading == Reading::orientation) {
      block.rightCols(3) = base;
      right.segment(3 * k, 3) = errors.row(rows[k]).transpose() * (lever_mm / seen.lever_mm);
    } else {
      block.leftCols(3) = base;
      block.rightCols(3) = -cross_matrix(arms.row(rows[k]).transpose()) * base / lever_mm;
      right.segment(3 * k, 3) = errors.row(rows[k]).transpose();
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        if (!measurements.measured[axis]) block.row(axis).setZero();
      }
    }
  }
  Eigen::VectorXd twist = equations.completeOrthogonalDecomposition().solve(right);
  twist.tail<3>() /= lever_mm;
  return twist;
}

// Model minus measurement in the world frame, zero where nothing was measured.
Eigen::MatrixXd world_errors_of(const Robot& robot, const Measurements& measurements) {
  Eigen::MatrixXd errors = measurements.positions_mm - positions(robot, measurements.poses);
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    if (!measurements.measured[axis]) errors.col(axis).setZero();
  }
  return errors;
}

Stands stands_of(const Robot& robot, const Measurements& measurements) {
  const std::vector<Observation>& observations = measurements.poses.observations;
  std::map<std::pair<Eigen::Index, std::string>, std::vector<Eigen::Index>> groups;
  for (Eigen::Index i = 0; i < measurements.count(); ++i) {
    if (observations[i].reading == Reading::distance) {
      throw std::invalid_argument("llmt::robotics::fit_correction: distances do not tell a correction of positions");
    }
    groups[{observations[i].stand, observations[i].base}].push_back(i);
  }
  const Eigen::MatrixXd errors = world_errors_of(robot, measurements);
  const Eigen::MatrixXd arms = arms_of(robot, measurements.poses);
  std::vector<Eigen::Index> first;
  std::vector<Eigen::VectorXd> twists;
  // A single point does not tell how the tool is turned. If most stands have more, those with one are left out;
  // if few have, nothing is learnt of turning.
  const auto with_several = std::ranges::count_if(groups, [](const auto& stand) { return stand.second.size() > 1; });
  const bool learns_turning = 2 * with_several >= std::ssize(groups);
  for (const auto& [stand, rows] : groups) {
    if (learns_turning && rows.size() == 1) continue;
    std::vector<Eigen::Index> points;
    for (const Eigen::Index row : rows) {
      if (observations[row].reading == Reading::position) points.push_back(row);
    }
    if (!learns_turning && points.empty()) continue;
    first.push_back(rows.front());
    if (learns_turning) {
      twists.push_back(twist_of(robot, measurements, errors, arms, rows));
    } else {
      const Eigen::Matrix3d base = base_rotation_of(robot.chain, stand.second);
      twists.emplace_back(Eigen::VectorXd::Zero(6));
      twists.back().head<3>() = base.transpose() * errors(points, Eigen::all).colwise().mean().transpose();
    }
  }
  Stands stands{measurements.poses.joints(first, Eigen::all), Eigen::MatrixXd(std::ssize(first), 6)};
  for (std::size_t k = 0; k < twists.size(); ++k) stands.twists.row(k) = twists[k].transpose();
  const std::vector<double> labels = pose_labels(measurements.poses);
  for (const Eigen::Index row : first) stands.labels.push_back(labels[row]);
  return stands;
}

}  // namespace

Eigen::MatrixXd residuals(const Robot& robot, const Measurements& measurements) {
  validate(measurements, robot);
  return world_errors_of(robot, measurements) * base_rotation_of(robot.chain);  // rows: r' R = (R' r)'
}

namespace {

TrainingData residual_data(const Robot& robot, const Measurements& measurements, const std::vector<double>& groups) {
  const bool is_plain = measurements.poses.observations.empty();
  const Stands stands =
      is_plain ? Stands{measurements.poses.joints, residuals(robot, measurements)} : stands_of(robot, measurements);
  std::vector<Eigen::Index> axes;
  std::vector<std::string> names;
  for (Eigen::Index axis = 0; axis < stands.twists.cols(); ++axis) {
    if (stands.twists.col(axis).isZero(0.0)) continue;
    axes.push_back(axis);
    names.push_back(correction_outputs[axis]);
  }
  if (axes.empty()) throw std::invalid_argument("llmt::robotics::fit_correction: all residuals are zero");
  TrainingData data{.inputs = stands.joints, .outputs = stands.twists(Eigen::all, axes)};
  data.groups = is_plain ? groups : stands.labels;  // every stand is one sample now
  data.input_names = correction_inputs(robot.chain);
  data.output_names = names;
  data.may_have_codes = false;  // joint positions that were measured on a grid are no names
  return data;
}

}  // namespace

FitResult fit_correction(const Robot& robot, const Measurements& measurements, const FitOptions& options,
                         const std::vector<double>& groups, const Progress& progress) {
  return fit(residual_data(robot, measurements, groups), options, progress);
}

BoostResult fit_boosted_correction(const Robot& robot, const Measurements& measurements, const BoostOptions& options,
                                   const std::vector<double>& groups, const Progress& progress) {
  BoostOptions own = options;
  own.mean_of_few = true;
  return fit_boosted(residual_data(robot, measurements, groups), own, progress);
}

Eigen::MatrixXd positions(const CorrectedRobot& robot, const Poses& poses) {
  Eigen::MatrixXd points = positions(robot.robot, poses);
  if (!robot.correction) return points;
  const CorrectionTwist correction(*robot.correction, robot.robot.chain);
  if (poses.observations.empty()) {
    points += correction.at(poses.joints).leftCols(3) * base_rotation_of(robot.robot.chain).transpose();
    return points;
  }
  const std::vector<Pose> tools = tool_poses(robot, poses);
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    points.row(i) = reading_of(tools[i], &poses.observations[i]).transpose();
  }
  return points;
}

std::vector<Pose> tool_poses(const CorrectedRobot& robot, const Poses& poses) {
  std::vector<Pose> tools = tool_poses(robot.robot, poses);
  if (!robot.correction) return tools;
  const CorrectionTwist correction(*robot.correction, robot.robot.chain);
  const Eigen::MatrixXd twists = correction.at(poses.joints);
  const bool is_plain = poses.observations.empty();
  const Eigen::MatrixXd arms = is_plain ? Eigen::MatrixXd::Zero(poses.count(), 3) : arms_of(robot.robot, poses);
  for (Eigen::Index i = 0; i < std::ssize(tools); ++i) {
    const Eigen::Matrix3d base =
        base_rotation_of(robot.robot.chain, is_plain ? std::string() : poses.observations[i].base);
    tools[i] = moved(tools[i], twists.row(i).transpose(), base, arms.row(i).transpose());
  }
  return tools;
}

CorrectedRobot read_corrected_robot(const std::string& path, const UrdfLinks& links) {
  CorrectedRobot robot{.robot = read_robot(path, links), .correction = {}};
  if (robot.robot.correction_file.empty()) return robot;
  const std::filesystem::path model = std::filesystem::path(path).parent_path() / robot.robot.correction_file;
  const std::string text = read_file(model.string(), model_limit);
  if (!is_correction(text)) {
    throw std::runtime_error(fmt::format("{}: correction: {} is no model file", path, model.string()));
  }
  robot.correction = correction_from_json(text, model.string());
  try {
    CorrectionTwist(*robot.correction, robot.robot.chain);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(fmt::format("{}: {}", model.string(), error.what()));
  }
  return robot;
}

}  // namespace llmt::robotics
