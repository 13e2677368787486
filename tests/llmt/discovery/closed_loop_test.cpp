#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "llmt/discovery/least_squares.hpp"
#include "noise.hpp"

namespace llmt::discovery {
namespace {

// A planar five-bar: motors at A = (0, 0) and B = (w, 0), proximal links l1, l2 that end in C and D, distal links l3,
// l4 that meet in the measured point P. |P - C| = l3 and |P - D| = l4 close the loop without the passive angles: f(d,
// s, w) = 0 as it stands.
struct FiveBar {
  double w, l1, l2, l3, l4, offset1, offset2;
};

Eigen::VectorXd closure(const FiveBar& bar, const Eigen::MatrixXd& joints, const Eigen::MatrixXd& tool) {
  Eigen::VectorXd f(2 * joints.rows());
  for (Eigen::Index i = 0; i < joints.rows(); ++i) {
    const Eigen::Vector2d c =
        bar.l1 * Eigen::Vector2d(std::cos(joints(i, 0) + bar.offset1), std::sin(joints(i, 0) + bar.offset1));
    const Eigen::Vector2d d =
        Eigen::Vector2d(bar.w, 0.0) +
        bar.l2 * Eigen::Vector2d(std::cos(joints(i, 1) + bar.offset2), std::sin(joints(i, 1) + bar.offset2));
    f(2 * i) = (tool.row(i).transpose() - c).norm() - bar.l3;
    f(2 * i + 1) = (tool.row(i).transpose() - d).norm() - bar.l4;
  }
  return f;
}

TEST(LeastSquares, FiveBarLoopIsRecoveredFromItsClosureEquations) {
  const FiveBar truth{301.2, 199.4, 200.7, 350.9, 349.2, 0.004, -0.007};
  Noise noise(19);
  Eigen::MatrixXd joints(60, 2);
  Eigen::MatrixXd tool(60, 2);
  // The tool of the true mechanism: the upper intersection of two circles.
  for (Eigen::Index i = 0; i < joints.rows(); ++i) {
    joints.row(i) << 1.2 + 1.2 * noise.uniform(), 0.6 + 1.2 * noise.uniform();
    const double a1 = joints(i, 0) + truth.offset1;
    const double a2 = joints(i, 1) + truth.offset2;
    const Eigen::Vector2d c = truth.l1 * Eigen::Vector2d(std::cos(a1), std::sin(a1));
    const Eigen::Vector2d d = Eigen::Vector2d(truth.w, 0.0) + truth.l2 * Eigen::Vector2d(std::cos(a2), std::sin(a2));
    const double distance = (d - c).norm();
    const double along = (distance * distance + truth.l3 * truth.l3 - truth.l4 * truth.l4) / (2.0 * distance);
    const Eigen::Vector2d e = (d - c) / distance;
    tool.row(i) =
        (c + along * e + std::sqrt(truth.l3 * truth.l3 - along * along) * Eigen::Vector2d(-e(1), e(0))).transpose();
  }
  LeastSquaresProblem problem;
  problem.parameters = {{"w", "mm", 300.0, 1.0},      {"l1", "mm", 200.0, 1.0}, {"l2", "mm", 200.0, 1.0},
                        {"l3", "mm", 350.0, 1.0},     {"l4", "mm", 350.0, 1.0}, {"offset1", "rad", 0.0, 1e-3},
                        {"offset2", "rad", 0.0, 1e-3}};
  problem.residual = [=](const Eigen::VectorXd& d) {
    return closure({d(0), d(1), d(2), d(3), d(4), d(5), d(6)}, joints, tool);
  };
  const SolverResult result = solve(problem);
  EXPECT_TRUE(result.converged()) << result.reason;
  EXPECT_TRUE(result.unidentifiable.empty());
  const Eigen::VectorXd expected{{truth.w, truth.l1, truth.l2, truth.l3, truth.l4, truth.offset1, truth.offset2}};
  EXPECT_LT((result.values - expected).cwiseAbs().maxCoeff(), 1e-6);
}

}  // namespace
}  // namespace llmt::discovery
