// What the errors of nearby poses have in common: a model that lacks something errs alike at like poses.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "llmt/robotics/measurements.hpp"
#include "llmt/robotics/robot_types.hpp"

namespace llmt::robotics {

/// Residuals of points as noise of one coordinate has them where the model is complete, and as a smooth function of the
/// joints has them where it is not: variance sigma^2 and, between two poses, the correlation share exp(-d / range),
/// each axis its own. d is the distance of the joint values as points (cos q, sin q), q over the reach if prismatic.
struct SharedError {
  double share = 0.0;  ///< 0: independent residuals
  double range = 0.0;  ///< rad
  double sigma = 0.0;  ///< mm
};

/// The coordinates of points among the rows of a linearised problem. Long tables are cut into stretches: what poses of
/// two stretches have in common does not count.
struct PointStretch {
  std::vector<std::vector<Eigen::Index>> of_axis;  ///< rows of the problem, one list an axis that was measured
  Eigen::MatrixXd places;  ///< of the poses, a column each; distances between columns are those of poses
};
using PointRows = std::vector<PointStretch>;
PointRows point_rows(const Chain& chain, const Measurements& measurements, const std::vector<Eigen::Index>& rows,
                     Eigen::Index longest = 250);

/// The most likely one of a grid, by restricted maximum likelihood (Patterson and Thompson 1971): only what no change
/// of the parameters explains tells of it, so that a movement does not count. sigma is no less than `known`, the noise
/// at calibration: poses that scatter less now, with all parameters free, have the rest of it in common.
SharedError likeliest_shared_error(const PointRows& points, const Eigen::MatrixXd& jacobian,
                                   const Eigen::VectorXd& residuals, double known);

/// Rows of points as independent ones: multiplied by the inverse of the factor L of the correlations L L'; and back.
Eigen::MatrixXd whitened(const SharedError& shared, const PointRows& points, Eigen::MatrixXd rows);
Eigen::MatrixXd coloured(const SharedError& shared, const PointRows& points, Eigen::MatrixXd rows);

}  // namespace llmt::robotics
