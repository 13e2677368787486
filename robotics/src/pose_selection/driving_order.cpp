#include "pose_selection/driving_order.hpp"

#include <limits>

namespace llmt::robotics {
namespace {

DrivingOrder nearest_neighbours(const Eigen::MatrixXd& joints_deg, Eigen::Index start) {
  const Eigen::Index count = joints_deg.rows();
  DrivingOrder order{.poses = {start}};
  std::vector<bool> visited(count, false);
  visited[start] = true;
  while (std::ssize(order.poses) < count) {
    Eigen::VectorXd moves =
        (joints_deg.rowwise() - joints_deg.row(order.poses.back())).rowwise().lpNorm<Eigen::Infinity>();
    for (Eigen::Index i = 0; i < count; ++i) {
      if (visited[i]) moves(i) = std::numeric_limits<double>::infinity();
    }
    Eigen::Index next = 0;
    order.travel_deg += moves.minCoeff(&next);
    visited[next] = true;
    order.poses.push_back(next);
  }
  return order;
}

}  // namespace

DrivingOrder driving_order(const Eigen::MatrixXd& joints_deg) {
  DrivingOrder best = nearest_neighbours(joints_deg, 0);
  for (Eigen::Index start = 1; start < joints_deg.rows(); ++start) {
    DrivingOrder order = nearest_neighbours(joints_deg, start);
    if (order.travel_deg < best.travel_deg) best = std::move(order);
  }
  return best;
}

}  // namespace llmt::robotics
