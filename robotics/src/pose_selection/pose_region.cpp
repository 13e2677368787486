#include "pose_selection/pose_region.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <stdexcept>

#include "kinematics/units.hpp"

namespace llmt::robotics {
namespace {

Chain without_base(Chain chain) {
  chain.base = {};
  return chain;
}

// Joint values in one degree.
Eigen::VectorXd degree_of(const Chain& chain) {
  Eigen::VectorXd unit(std::ssize(chain.joints));
  double reach = reach_of(chain);
  // A machine of slides alone reaches as far as these.
  for (std::size_t j = 0; j < chain.joints.size() && reach_of(chain) == 0.0; ++j) {
    const Joint& joint = chain.joints[j];
    if (joint.type == JointType::prismatic && joint.limits) reach += joint.limits->at(1) - joint.limits->at(0);
  }
  for (Eigen::Index j = 0; j < unit.size(); ++j) {
    unit(j) = chain.joints[j].type == JointType::revolute ? radians : radians * reach;
  }
  return unit;
}

}  // namespace

Eigen::MatrixXd joint_degrees(const Chain& chain, const Eigen::MatrixXd& joints) {
  return joints * degree_of(chain).cwiseInverse().asDiagonal();
}

PoseRegion::PoseRegion(const Chain& chain, const std::optional<ToolBox>& box)
    : kinematics_(without_base(chain)), followers_(followers_of(chain)), box_(box), unit_(degree_of(chain)) {
  if (box && !(box->lower_mm.array() <= box->upper_mm.array()).all()) {
    throw std::invalid_argument("llmt::robotics::select_poses: a lower bound of the box is above the upper one");
  }
  const JointRanges ranges = joint_ranges(chain, "llmt::robotics::select_poses");
  lower_ = ranges.low;
  upper_ = ranges.high;
}

Eigen::VectorXd PoseRegion::nearest(const Eigen::VectorXd& joints) const {
  return followed(followers_, joints.cwiseMax(lower_).cwiseMin(upper_));
}

bool PoseRegion::contains(const Eigen::VectorXd& joints) const {
  if (!(joints.array() >= lower_.array()).all() || !(joints.array() <= upper_.array()).all()) return false;
  if (!box_) return true;
  const Eigen::Array3d tool = kinematics_.forward(joints).position_mm;
  return (tool >= box_->lower_mm.array()).all() && (tool <= box_->upper_mm.array()).all();
}

bool PoseRegion::lead_into_box(Eigen::VectorXd& joints, const Eigen::Vector3d& target) const {
  constexpr int most_steps = 30;
  for (int step = 0; step < most_steps; ++step) {
    if (contains(joints)) return true;
    const Eigen::Vector3d missing = target - kinematics_.forward(joints).position_mm;
    Eigen::MatrixXd jacobian = kinematics_.joint_jacobian(joints).topRows(3);
    lead(followers_, jacobian);
    jacobian = jacobian * unit_.asDiagonal();
    Eigen::Matrix3d square = jacobian * jacobian.transpose();
    square.diagonal().array() += 1e-3 * square.trace() + 1e-12;
    const Eigen::VectorXd move = jacobian.transpose() * square.llt().solve(missing);
    constexpr double longest_deg = 20.0;
    const double shorter = std::min(1.0, longest_deg / std::max(1e-12, move.lpNorm<Eigen::Infinity>()));
    joints = nearest(joints + shorter * unit_.cwiseProduct(move));
  }
  return contains(joints);
}

Eigen::MatrixXd PoseRegion::random(Eigen::Index count, Random& random) const {
  constexpr int most_failures = 300;
  Eigen::MatrixXd poses(count, unit_.size());
  int failures = 0;
  for (Eigen::Index i = 0; i < count;) {
    Eigen::VectorXd joints = Eigen::VectorXd::Zero(unit_.size());
    for (Eigen::Index j = 0; j < joints.size(); ++j) {
      if (std::isfinite(lower_(j))) joints(j) = random.uniform(lower_(j), upper_(j));
    }
    joints = followed(followers_, joints);
    Eigen::Vector3d target = Eigen::Vector3d::Zero();
    for (int axis = 0; box_ && axis < 3; ++axis) {
      target(axis) = random.uniform(box_->lower_mm(axis), box_->upper_mm(axis));
    }
    if (box_ && !lead_into_box(joints, target)) {
      if (++failures == most_failures) {
        throw std::runtime_error(
            fmt::format("llmt::robotics::select_poses: no pose within the joint limits brings the tool into the box, x "
                        "{} ... {}, y {} ... {}, z {} ... {} mm in the frame of the robot's base",
                        box_->lower_mm(0), box_->upper_mm(0), box_->lower_mm(1), box_->upper_mm(1), box_->lower_mm(2),
                        box_->upper_mm(2)));
      }
      continue;
    }
    failures = 0;
    poses.row(i++) = joints.transpose();
  }
  return poses;
}

void PoseRegion::add_neighbours(const Eigen::VectorXd& joints, double step_deg, Random& random,
                                std::vector<Eigen::VectorXd>& poses) const {
  const auto add = [&](Eigen::VectorXd moved) {
    moved = nearest(moved);
    if (contains(moved)) poses.push_back(std::move(moved));
  };
  for (Eigen::Index j = 0; j < joints.size(); ++j) {
    if (!std::isfinite(lower_(j))) continue;  // it follows another
    for (const double side : {-1.0, 1.0}) {
      Eigen::VectorXd moved = joints;
      moved(j) += side * step_deg * unit_(j);
      add(std::move(moved));
    }
  }
  for (Eigen::Index k = 0; k < 2 * joints.size(); ++k) {
    Eigen::VectorXd moved = joints;
    for (Eigen::Index j = 0; j < joints.size(); ++j) moved(j) += 0.5 * step_deg * unit_(j) * random.normal();
    add(std::move(moved));
  }
}

}  // namespace llmt::robotics
