// Inputs that are a position, its speed and its acceleration.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "discovery/terms/derivatives.hpp"
#include "llmt/discovery/model_term.hpp"

namespace llmt::discovery {

struct Motion {
  Eigen::Index position = 0;  ///< columns of the inputs
  Eigen::Index speed = 0;
  Eigen::Index acceleration = 0;
  double second = 1.0;  ///< in units of the instants
};

/// Found by comparing derivatives of the inputs with the other inputs.
std::vector<Motion> motions(const Derivatives& derivatives, const Inputs& inputs);

/// Whether an input is the first or second derivative by time of an output (n values).
bool is_derivative_of(const Derivatives& derivatives, const Eigen::VectorXd& input, const Eigen::VectorXd& output);

/// Inputs whose speeds have less errors, and what that changes.
struct SmoothedInputs {
  Inputs inputs;
  Eigen::VectorXd errors;          ///< standard deviations in what was replaced, before; 0: the input was not smoothed
  Eigen::MatrixXd change;          ///< n x d of the simulated outputs; empty: nothing was smoothed
  std::vector<bool> unknown_sign;  ///< rows at which a speed was not smoothed, and is within 3 standard deviations of 0
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
SmoothedInputs smoothed(const Inputs& inputs, const Eigen::MatrixXd& simulated);

}  // namespace llmt::discovery
