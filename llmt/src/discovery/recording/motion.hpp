// Speeds with less errors, from the positions and accelerations that belong to them.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "discovery/recording/apart.hpp"
#include "discovery/recording/recording.hpp"

namespace llmt::discovery {

/// Inputs whose speeds have less errors, and what that changes.
struct SmoothedInputs {
  Recording recording;
  Eigen::VectorXd errors;          ///< standard deviations in what was replaced, before; 0: the input was not smoothed
  Eigen::MatrixXd change;          ///< n x d of the simulated outputs; empty: nothing was smoothed
  Apart unknown_sign;              ///< rows at which a speed was not smoothed, and is within 3 standard deviations of 0
  std::vector<std::string> notes;  ///< in sentences
};

/// For rows in time. A speed is the derivative of a position, which is often known better. It is replaced by that of a
/// polynomial of the fifth degree, fitted to position, speed and acceleration at once over the rows within which no
/// signal changes much, each weighted by the variance of its errors (fourth differences). This is done where the errors
/// of the speed then are at most a third, and what was taken off it has at most 1.1 times their standard deviation.
/// Where a machine sticks or strikes, its acceleration jumps: accelerations stay as they are, and so do speeds at rows
/// around which the polynomial leaves more than the errors (chi^2), in narrower windows as well. The simulated outputs
/// (n x d) follow by the function of the inputs that describes at least 98 % of their variance; where there is none,
/// nothing is replaced.
SmoothedInputs smoothed(const Recording& recording, const Eigen::MatrixXd& simulated);

}  // namespace llmt::discovery
