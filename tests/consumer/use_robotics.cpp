// A planar arm of two links of 300 and 200 mm: where its tool is at 30 and 60 degrees.
#include <cmath>
#include <iostream>
#include <numbers>

#include "llmt/robotics/chain.hpp"
#include "llmt/robotics/kinematics.hpp"

int main() {
  llmt::robotics::Chain arm;
  arm.name = "arm";
  arm.convention = llmt::robotics::Convention::dh;
  arm.joints.resize(2);
  arm.joints[0].name = "shoulder";
  arm.joints[0].a_mm = 300.0;
  arm.joints[1].name = "elbow";
  arm.joints[1].a_mm = 200.0;

  const double degree = std::numbers::pi / 180.0;
  const Eigen::Vector2d q(30.0 * degree, 60.0 * degree);
  const Eigen::Vector3d tool = llmt::robotics::forward(arm, q).position_mm;
  const Eigen::Vector3d expected(300.0 * std::cos(q(0)), 300.0 * std::sin(q(0)) + 200.0, 0.0);
  std::cout << "tool at " << tool.transpose() << " mm\n";
  const bool right = (tool - expected).norm() < 1e-9;
  std::cout << (right ? "consumer ok" : "wrong position") << '\n';
  return right ? 0 : 1;
}
