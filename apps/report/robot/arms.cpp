#include "report/robot/arms.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "llmt/robotics/kinematics.hpp"
#include "report/document/figures.hpp"
#include "report/text/text.hpp"

namespace llmt::report {
namespace {

using robotics::JointType;
using robotics::Measurements;

constexpr Eigen::Index most_arrows = 400;

// The lower and the upper end of a joint in degrees or mm: its limits, widened where poses lie beyond.
std::pair<double, double> range_of(const robotics::Chain& chain, const Numbers& values, Eigen::Index joint) {
  const auto [low, high] = std::ranges::minmax(values);
  const auto& limits = chain.joints[joint].limits;
  if (limits) return {std::min(low, (*limits)[0]), std::max(high, (*limits)[1])};
  if (chain.joints[joint].type == JointType::prismatic) return {low, high};
  return {std::min(low, -180.0), std::max(high, 180.0)};
}

}  // namespace

Eigen::MatrixXd errors_at(const Eigen::MatrixXd& model_mm, const Measurements& measured) {
  Eigen::MatrixXd errors = measured.positions_mm - model_mm;
  for (int axis = 0; axis < 3; ++axis) {
    if (!measured.measured[axis]) errors.col(axis).setZero();
  }
  return errors;
}

double arrow_scale(const Eigen::MatrixXd& errors_mm, const Measurements& measured) {
  const double typical = quantile(numbers_of(errors_mm.rowwise().norm()), 0.9);
  const double size = (measured.positions_mm.colwise().maxCoeff() - measured.positions_mm.colwise().minCoeff()).norm();
  if (!(typical > 0.0) || !(size > 0.0)) return 1.0;
  const double wanted = 0.07 * size / typical;
  const double power = std::pow(10.0, std::floor(std::log10(wanted)));
  return std::max(1.0, power * (wanted / power >= 5.0 ? 5.0 : wanted / power >= 2.0 ? 2.0 : 1.0));
}

Arm arm_picture(const std::string& title, const robotics::Robot& robot, const Measurements& measured,
                const Eigen::MatrixXd& errors_mm, double scale, const std::string& role) {
  const Eigen::MatrixXd& joints = measured.poses.joints;
  const Eigen::RowVectorXd middle = joints.colwise().mean();
  Eigen::Index pose = 0;
  (joints.rowwise() - middle).rowwise().squaredNorm().minCoeff(&pose);
  const robotics::Skeleton skeleton = robotics::Kinematics(robot.chain).skeleton(joints.row(pose).transpose());
  Arm arm{.title = title,
          .path = {},
          .points = {},
          .tips = {},
          .arrows = fmt::format("error x {:.0f}", scale),
          .role = role};
  const auto links = std::ssize(skeleton.link_end);
  arm.path.resize(2 * links + 1, 3);
  arm.path.row(0) = robot.chain.base.xyz_mm.transpose();
  for (Eigen::Index i = 0; i < links; ++i) {
    arm.path.row(2 * i + 1) = skeleton.joint_origin[i].transpose();
    arm.path.row(2 * i + 2) = skeleton.link_end[i].transpose();
  }
  const std::vector<Eigen::Index> rows = thinned(measured.count(), most_arrows);
  const Eigen::MatrixXd model = robotics::positions(robot, robotics::select(measured.poses, rows));
  arm.points = measured.positions_mm(rows, Eigen::all);
  for (int axis = 0; axis < 3; ++axis) {
    if (!measured.measured[axis]) arm.points.col(axis) = model.col(axis);
  }
  arm.tips = arm.points + scale * errors_mm(rows, Eigen::all);
  arm.caption =
      fmt::format("Lines at the measured points: measured - model, {:.0f} times as long as they are.{} Drag to turn.",
                  scale, thinning_note(measured.count(), "poses", most_arrows));
  return arm;
}

Chart error_per_pose(const std::vector<std::pair<std::string, Eigen::VectorXd>>& stages,
                     const std::vector<std::string>& roles) {
  constexpr Eigen::Index most_poses = 1000;
  const Eigen::Index count = stages.front().second.size();
  Chart chart{.title = "Error of every pose",
              .caption = "In the order of the file." + thinning_note(count, "poses", most_poses),
              .x = {"pose"},
              .y = {"position error, mm"},
              .layers = {},
              .wide = true};
  for (std::size_t s = 0; s < stages.size(); ++s) {
    Layer layer{.mark = count <= 120 ? Mark::line : Mark::points, .name = stages[s].first, .role = roles[s]};
    for (const Eigen::Index row : thinned(count, most_poses)) {
      layer.x.push_back(static_cast<double>(row + 1));
      layer.y.push_back(stages[s].second(row));
    }
    chart.layers.push_back(std::move(layer));
  }
  return chart;
}

Eigen::VectorXd along_joint(const robotics::Robot& robot, const Measurements& measured,
                            const Eigen::MatrixXd& errors_mm, Eigen::Index joint) {
  const robotics::Kinematics kinematics(robot.chain);
  Eigen::VectorXd result(measured.count());
  for (Eigen::Index i = 0; i < measured.count(); ++i) {
    Eigen::Vector3d direction =
        kinematics.joint_jacobian(measured.poses.joints.row(i).transpose()).col(joint).head<3>();
    for (int axis = 0; axis < 3; ++axis) {
      if (!measured.measured[axis]) direction(axis) = 0.0;
    }
    const double length = direction.norm();
    result(i) = length > 0.0 ? errors_mm.row(i).dot(direction) / length : 0.0;
  }
  return result;
}

Numbers joint_values(const robotics::Chain& chain, const Eigen::MatrixXd& joints, Eigen::Index joint) {
  return numbers_of(joints.col(joint) * robotics::to_limit_unit(chain.joints[joint]));
}

std::string joint_axis(const robotics::Chain& chain, Eigen::Index joint) {
  return fmt::format("{}, {}", chain.joints[joint].name, robotics::limit_unit(chain.joints[joint]));
}

Map coverage(const robotics::Chain& chain, const Eigen::MatrixXd& joints) {
  constexpr int bins = 36;
  Map map{.title = "Where the joints were, and where not",
          .caption =
              "Share of the poses in each part of a joint's range. White or dark parts were not measured: nothing is "
              "known there.",
          .x = {"place in the joint's range, %"},
          .y = {},
          .xs = {},
          .ys = {},
          .z = Eigen::MatrixXd::Zero(joints.cols(), bins),
          .unit = "% of the poses",
          .cells = true,
          .reversed = true};
  for (int bin = 0; bin < bins; ++bin) map.xs.push_back(100.0 * (bin + 0.5) / bins);
  for (Eigen::Index j = 0; j < joints.cols(); ++j) {
    const Numbers values = joint_values(chain, joints, j);
    const auto [low, high] = range_of(chain, values, j);
    for (const double value : values) {
      const int bin = high > low ? std::clamp(static_cast<int>(bins * (value - low) / (high - low)), 0, bins - 1) : 0;
      map.z(j, bin) += 100.0 / static_cast<double>(joints.rows());
    }
    map.ys.push_back(static_cast<double>(j));
    map.y.categories.push_back(fmt::format("{}: {} to {}", joint_axis(chain, j), number(low, 3), number(high, 3)));
  }
  return map;
}

}  // namespace llmt::report
