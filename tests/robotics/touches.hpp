// An arm that touches sockets, planes and spheres, as the tests make it.
#pragma once

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <map>
#include <string>
#include <vector>

#include "kinematics/rotations.hpp"
#include "llmt/random.hpp"
#include "llmt/robotics/calibration.hpp"
#include "llmt/robotics/compensation.hpp"
#include "robotics/robots.hpp"

namespace llmt::robotics {

inline std::string lines_of(const Compensation& found, const std::string& name) {
  std::string text;
  for (Eigen::Index i = 0; i < found.after_mm.size(); ++i) {
    if (found.after_mm(i) > 1e-7) continue;
    for (const double q : found.commands.joints.row(i)) text += fmt::format("{},", q);
    text += name + "\n";
  }
  return text;
}

/// The arm holds a ball in each socket in turn, in `count` poses; where the ball really lies scatters by sigma.
inline Measurements in_sockets(const Robot& truth, int count, double sigma_mm) {
  const std::vector<Eigen::RowVector3d> centres = {{450, 250, 300}, {-350, 400, 150}, {100, -550, 450}};
  llmt::Random random(7);
  std::string text = "q1_rad,q2_rad,q3_rad,q4_rad,q5_rad,q6_rad,socket\n";
  for (std::size_t k = 0; k < centres.size(); ++k) {
    Targets targets;
    targets.start = random_poses(truth.chain, count, 50 + k);
    targets.positions_mm = centres[k].replicate(count, 1);
    for (double& value : targets.positions_mm.reshaped()) value += sigma_mm * random.normal();
    const Compensation found = compensate(CorrectedRobot{truth, {}}, targets, {.tolerance_mm = 1e-9});
    text += lines_of(found, fmt::format("s{}", k + 1));
  }
  return parse_measurements(text, "sockets.csv", truth);
}

/// The arm touches three faces of a tilted block at random places, which are flat but for sigma.
inline Measurements on_planes(const Robot& truth, int count, double sigma_mm) {
  const Eigen::Matrix3d block =
      (Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  llmt::Random random(8);
  std::string text = "q1_rad,q2_rad,q3_rad,q4_rad,q5_rad,q6_rad,plane\n";
  for (int axis = 0; axis < 3; ++axis) {
    Targets targets;
    targets.start = random_poses(truth.chain, count, 60 + axis);
    targets.positions_mm.resize(count, 3);
    for (int i = 0; i < count; ++i) {
      Eigen::Vector3d point(random.uniform(-500, 500), random.uniform(-500, 500), random.uniform(-500, 500));
      point(axis) = 200.0 + sigma_mm * random.normal();
      targets.positions_mm.row(i) = (block * point).transpose();
    }
    const Compensation found = compensate(CorrectedRobot{truth, {}}, targets, {.tolerance_mm = 1e-9});
    text += lines_of(found, fmt::format("face {}", axis));
  }
  return parse_measurements(text, "planes.csv", truth);
}

/// The arm touches four balls all around at random places, at a distance of `radius_mm` from their centres but for
/// sigma. Their radius is given in the table or not.
inline Measurements on_spheres(const Robot& truth, int count, double radius_mm, double sigma_mm, bool is_given) {
  const std::vector<Eigen::RowVector3d> centres = {
      {450, 250, 300}, {-350, 400, 150}, {100, -550, 450}, {-300, -300, 600}};
  llmt::Random random(9);
  std::string text = "q1_rad,q2_rad,q3_rad,q4_rad,q5_rad,q6_rad,sphere";
  text += is_given ? ",radius_mm\n" : "\n";
  for (std::size_t k = 0; k < centres.size(); ++k) {
    Targets targets;
    targets.start = random_poses(truth.chain, count, 70 + k);
    targets.positions_mm = centres[k].replicate(count, 1);
    for (auto point : targets.positions_mm.rowwise()) {
      const Eigen::RowVector3d way(random.normal(), random.normal(), random.normal());
      point += (radius_mm + sigma_mm * random.normal()) * way.normalized();
    }
    const Compensation found = compensate(CorrectedRobot{truth, {}}, targets, {.tolerance_mm = 1e-9});
    text += lines_of(found, is_given ? fmt::format("ball {},{}", k + 1, radius_mm) : fmt::format("ball {}", k + 1));
  }
  return parse_measurements(text, "spheres.csv", truth);
}

/// Mean distance on fresh poses between two arms, whatever their bases.
inline double shape_error_mm(const Robot& truth, const Robot& found) {
  const Poses fresh = random_poses(truth.chain, 300, 9);
  Robot own = found;
  own.chain.bases.clear();
  const Eigen::MatrixXd to = positions(truth, fresh);
  const Eigen::MatrixXd from = positions(own, fresh);
  const Pose base = kabsch(from, to);
  return ((from * base.rotation.transpose()).rowwise() + base.position_mm.transpose() - to).rowwise().norm().mean();
}

inline Robot real_arm() {
  Robot truth = perturbed(ur_like(), 0.5, 0.05, 3);
  truth.chain.joints[1].a_mm = ur_like().chain.joints[1].a_mm;  // the longest length: sockets alone show no scale
  return truth;
}

inline std::map<std::string, std::string> reasons_of(const Calibration& calibration) {
  std::map<std::string, std::string> reasons;
  for (const FixedParameter& entry : calibration.fixed) reasons[entry.name] = entry.why;
  return reasons;
}

/// What reading the rows throws.
inline std::string refused(const Robot& robot, const std::string& rows) {
  try {
    parse_measurements(rows, "m.csv", robot);
    return "no error";
  } catch (const std::runtime_error& error) {
    return error.what();
  }
}

}  // namespace llmt::robotics
