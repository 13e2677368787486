// What no choice of poses can beat.
#pragma once

#include "pose_selection/exchange.hpp"

namespace llmt::robotics {

/// Poses with fractions for numbers, and what follows for all choices of whole ones: see select_poses().
struct IdealDesign {
  Eigen::VectorXd weights;      ///< of the poses that were kept, sum 1
  Eigen::MatrixXd sensitivity;  ///< A W A: a pose with rows J would lower tr(A W) at the rate tr(J A W A J')
  double variance = 0.0;        ///< tr(A W), mm^2
  double from_given = 0.0;      ///< tr(A W A P)
};

/// The multiplicative algorithm for the variance of the position with `count` poses spread over those of `rows`; ends
/// half a per cent from the best variance, or after a number of steps.
IdealDesign ideal_design(const DesignProblem& problem, const Eigen::MatrixXd& rows, Eigen::Index count);

/// Numbers of the largest values, the largest first.
std::vector<Eigen::Index> largest(const Eigen::VectorXd& values, Eigen::Index count);

/// tr(J A W A J') of every pose.
Eigen::VectorXd sensitivities(const IdealDesign& design, const Eigen::MatrixXd& rows);

/// The bound on tr(A W) of any `count` poses if none has a larger sensitivity.
double variance_bound(const IdealDesign& design, Eigen::Index count, double largest_sensitivity);

}  // namespace llmt::robotics
