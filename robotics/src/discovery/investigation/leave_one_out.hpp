// Leave-one-pose-out errors of a fit, without fitting anew.
#pragma once

#include <Eigen/Core>

#include "llmt/robotics/calibration.hpp"

namespace llmt::robotics {

/// Distances of n samples with d components when each is left out of a linear fit: |(I - H_ii)^-1 e_i|, where e are the
/// n d errors of the fit of all and H = used' used its hat matrix (`used`: k x n d).
Eigen::VectorXd leave_one_out_distances(const Eigen::MatrixXd& used, const Eigen::VectorXd& errors, Eigen::Index d);

/// The distance of every pose from a robot that was fitted without it, mm: to first order, by the Jacobian of the
/// calibration's free parameters, for the poses that were fitted. The distances of the others (`skipped`, ascending)
/// are those from the robot as it is.
Eigen::VectorXd leave_one_out_distances(const Calibration& fitted, const Measurements& measurements,
                                        const std::vector<std::size_t>& skipped);

}  // namespace llmt::robotics
