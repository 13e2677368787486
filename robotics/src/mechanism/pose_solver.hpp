// One pose of a mechanism: adjusts readings to the equations and solves for what is not measured.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "mechanism/equations.hpp"

namespace llmt::robotics {

/// Which coordinates of a pose are what.
struct PoseKinds {
  std::vector<Eigen::Index> unknown;  ///< not measured
  std::vector<Eigen::Index> noisy;    ///< measured, with noise
};
PoseKinds kinds_of(const Eigen::VectorXd& known, const Eigen::VectorXd& sigma);

/// A pose that meets the equations.
struct SolvedPose {
  std::string failure;           ///< why there is none; empty if there is
  Eigen::VectorXd coordinates;   ///< all
  Eigen::VectorXd residual;      ///< r of calibrate(), one number per equation beyond the unknown coordinates
  Eigen::MatrixXd projection;    ///< dr = projection * df, residual x equations
  Eigen::MatrixXd unknown_rate;  ///< of the unknown coordinates with the other ones: unknown x coordinates

  bool ok() const { return failure.empty(); }
};

/// Minimises the sum of (v_i / sigma_i)^2 over corrections v of the noisy readings, with f = 0, by Gauss-Newton steps;
/// the unknown coordinates begin at `start`. The minimum has v = S B' m, B = N' df/dv S, N' df/dz = 0.
SolvedPose solve_pose(Equations& equations, const Eigen::VectorXd& parameters, const Eigen::VectorXd& known,
                      const Eigen::VectorXd& sigma, const Eigen::VectorXd& start, int most_steps = 60);

/// The configuration nearest to `start`, in typical() units, where all coordinates may move.
SolvedPose nearest_configuration(Equations& equations, const Eigen::VectorXd& parameters, const Eigen::VectorXd& start);

/// Goes from a solved pose to what is known of another one; see assemble().
SolvedPose follow(Equations& equations, const Eigen::VectorXd& parameters, const Eigen::VectorXd& from,
                  const Eigen::VectorXd& known, const Eigen::VectorXd& sigma);

}  // namespace llmt::robotics
