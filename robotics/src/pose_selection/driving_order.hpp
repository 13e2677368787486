// The order in which poses are driven.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace llmt::robotics {

struct DrivingOrder {
  std::vector<Eigen::Index> poses;
  double travel_deg = 0.0;  ///< sum over the moves of the largest move of a joint
};

/// Nearest neighbours from the start that makes the whole way shortest; `joints_deg` is n x J.
DrivingOrder driving_order(const Eigen::MatrixXd& joints_deg);

}  // namespace llmt::robotics
