// The choice of poses by exchange.
#pragma once

#include <vector>

#include "llmt/progress.hpp"
#include "llmt/robotics/pose_selection_options.hpp"

namespace llmt::robotics {

/// The criterion that the chosen poses optimise. L parameters, times their scales; every pose is three rows of
/// derivatives, in units of the noise.
struct DesignProblem {
  PoseCriterion criterion = PoseCriterion::position;
  Eigen::MatrixXd given;  ///< L x L: information of priors and of poses already measured
  Eigen::MatrixXd use;    ///< L x L: mean of J'J over the poses of use, mm^2
};

/// The rows of the poses of those numbers.
Eigen::MatrixXd rows_of_poses(const Eigen::MatrixXd& rows, const std::vector<Eigen::Index>& poses);

/// The sum of J'J over the poses of those numbers.
Eigen::MatrixXd information(const Eigen::MatrixXd& rows, const std::vector<Eigen::Index>& poses);

/// The loss to minimise: the variance of the position in mm^2 for `position`, else a falling function of the index.
/// Infinite where the matrix is not positive definite.
double loss(const DesignProblem& problem, const Eigen::MatrixXd& information);

/// The loss with each pose added to the information; infinite where the pose is not allowed. With o2 ... o5 only the
/// sixteen that the derivative of the index favours are tried, the others are infinite too.
Eigen::VectorXd losses_with(const DesignProblem& problem, const Eigen::MatrixXd& information,
                            const Eigen::MatrixXd& rows, const std::vector<bool>& allowed);

/// The distances that poses keep: joint values in degrees, and of poses that are there already.
struct Spacing {
  double degrees = 0.0;
  Eigen::MatrixXd candidates;  ///< N x J
  std::vector<bool> turns;     ///< J: whether values that differ by 360 are the same
  Eigen::MatrixXd measured;    ///< M x J
};

/// `count` poses out of those of `rows`: the `start`, filled up greedily, then exchanged until no exchange lowers the
/// loss. Fewer poses are returned where the spacing leaves no more. `work` may stop the exchange.
std::vector<Eigen::Index> choose_by_exchange(const DesignProblem& problem, const Eigen::MatrixXd& rows,
                                             const Spacing& spacing, std::vector<Eigen::Index> start,
                                             Eigen::Index count, Work* work = nullptr);

}  // namespace llmt::robotics
