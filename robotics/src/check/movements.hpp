// The search for the parameters of a robot that moved.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

namespace llmt::robotics {

/// Parameters that are tested together.
struct Suspect {
  std::string name;
  std::vector<Eigen::Index> columns;
};

/// measured - calibrated = J (those of `nuisance` + errors of the calibration + those that moved) + noise.
struct MovementProblem {
  Eigen::MatrixXd jacobian;            ///< n x K, columns times the parameters' scales
  Eigen::VectorXd residuals;           ///< n
  std::vector<Eigen::Index> nuisance;  ///< columns that are fitted in any case
  Eigen::MatrixXd covariance;          ///< K x K, of the calibrated values over their scales; 0 where they are exact
  std::vector<Suspect> suspects;
  double level = 0.05;
  double least_noise = 0.0;  ///< what is left may be smaller by chance, the noise is not
};

struct Movement {
  std::size_t suspect = 0;
  std::vector<double> changes;  ///< of its columns, all that moved being fitted together
  std::vector<double> standard_errors;
  double probability = 0.0;
  std::vector<std::size_t> or_else;
};

/// What no change of any parameter explains.
struct Unexplained {
  double noise = 0.0;    ///< standard deviation of a residual
  double freedom = 0.0;  ///< degrees of freedom behind it
};
Unexplained unexplained(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residuals);

struct Movements {
  std::vector<Movement> found;
  std::vector<std::size_t> unseen;
  Eigen::VectorXd left;  ///< residuals after nuisance and what moved
};

/// See check_robot().
Movements find_movements(const MovementProblem& problem);

}  // namespace llmt::robotics
