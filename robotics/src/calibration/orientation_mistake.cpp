#include "calibration/orientation_mistake.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <exception>
#include <string>
#include <vector>

#include "kinematics/units.hpp"
#include "llmt/robotics/calibration.hpp"
#include "llmt/robotics/orientation.hpp"

namespace llmt::robotics {
namespace {

using Rotations = std::vector<Eigen::Matrix3d>;

// Mean angle by which rotations differ from the one that is nearest to all, rad.
double scatter_of(const Rotations& rotations) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Eigen::Matrix3d& own : rotations) sum += own;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs = Eigen::Vector3d::Ones();
  signs(2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
  const Eigen::Matrix3d mean = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  double angles = 0.0;
  for (const Eigen::Matrix3d& own : rotations) angles += Eigen::AngleAxisd(mean.transpose() * own).angle();
  return angles / static_cast<double>(rotations.size());
}

struct Writing {
  std::string name;
  std::string words;
  Rotations rotations;
};

// What the table has, as other ways of writing would have it. `convention`: as it is read.
std::vector<Writing> other_readings(const Orientation& written, const std::string& convention) {
  std::vector<Writing> readings;
  if (written.kind == Orientation::Kind::angles_deg) {
    for (const char* order : {"xyz", "xzy", "yxz", "yzx", "zxy", "zyx"}) {
      const std::string name = std::string("intrinsic_") + order;
      readings.push_back({"orientation_" + name, fmt::format("the angles rx, ry, rz are {}, not {}", name, convention),
                          rotations_of(written, name)});
    }
  } else {
    Orientation last = written;
    last.values << written.values.rightCols(1), written.values.leftCols(3);
    readings.push_back({"orientation_w_last", "the quaternions have their w last, not first", rotations_of(last, "")});
  }
  Rotations inverse = rotations_of(written, convention);
  for (Eigen::Matrix3d& own : inverse) own.transposeInPlace();
  readings.push_back({"orientation_inverse",
                      "the orientations are those of the instrument in the frame of the tool, not the other way about",
                      std::move(inverse)});
  return readings;
}

}  // namespace

std::optional<OrientationMistake> likely_orientation_mistake(const Robot& robot, const Measurements& measurements) {
  constexpr std::size_t fewest = 10;
  constexpr double far_better = 0.1;
  constexpr double largest = 3.0 / degrees;
  const std::vector<Eigen::Index> rows = orientation_rows(measurements.poses);
  if (rows.size() < fewest || measurements.orientation.values.rows() != measurements.count()) return {};
  Rotations tool;
  try {
    Robot placed = with_frames(robot, measurements);
    register_frames(placed, select(measurements, position_rows(measurements.poses)));
    for (const Pose& pose : tool_poses(placed, select(measurements.poses, rows))) tool.push_back(pose.rotation);
  } catch (const std::exception&) {
    return {};
  }
  const auto differences = [&](const Rotations& measured) {
    Rotations between;
    for (std::size_t k = 0; k < tool.size(); ++k) between.push_back(tool[k].transpose() * measured[k]);
    return scatter_of(between);
  };
  const Orientation written = select(measurements, rows).orientation;
  const std::string& convention = written.convention.empty() ? robot.chain.orientation : written.convention;
  const double as_read = differences(rotations_of(written, convention));
  std::optional<OrientationMistake> best;
  double least = std::min(largest, far_better * as_read);
  for (const Writing& other : other_readings(written, convention)) {
    const double scatter = differences(other.rotations);
    if (!(scatter < least)) continue;
    least = scatter;
    best = OrientationMistake{other.name,
                              fmt::format("most likely {}: orientations would then differ from the described robot's "
                                          "by {:.3g} deg instead of {:.3g} deg",
                                          other.words, scatter * degrees, as_read * degrees)};
  }
  return best;
}

}  // namespace llmt::robotics
