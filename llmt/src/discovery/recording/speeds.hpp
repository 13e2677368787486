// Speeds of machines: known better from their positions, and not known where a machine rests.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "discovery/recording/recording.hpp"

namespace llmt::discovery {

/// Errors hide the sign of an input within so many of their standard deviations.
inline constexpr double hides_the_sign = 3.0;

/// Inputs whose speeds have less errors, and what that changes.
struct SmoothedInputs {
  Recording recording;
  Eigen::VectorXd errors;  ///< standard deviations in what was replaced, before; 0: the input was not smoothed
  Eigen::MatrixXd change;  ///< n x d of the simulated outputs; empty: nothing was smoothed
  std::vector<Eigen::Index> unknown_sign;  ///< rows where a speed was not smoothed, and its sign is not known
  std::vector<std::string> notes;          ///< in sentences
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

/// For rows in time: p zero bands, 0 for inputs that do not rest. An input rests if it changes sign, is smooth in
/// time, and stands at 0 more often than it passes: at least 20 rows lie within the band, and the outer half of the
/// band holds at least three times as many rows as an interval of that width where the input passes. Dry friction at
/// rest is whatever holds, so that rows within the band say nothing of it. They matter where the deviations (n x d)
/// jump: least squares of the next tenth of the rows on both sides on 1, x and sgn x gives sgn x more than 4 standard
/// errors. Else the band is 0. Bands of more than half of the rows are not looked at. Of a position, its speed and its
/// acceleration (`motions`) only the speed rests. Where several inputs jump, as axes that stop together, the surest is
/// taken first; the next is looked at on the rows that are left, with the signs of those taken as columns beside it.
Eigen::VectorXd zero_bands(const Recording& recording, const Eigen::MatrixXd& deviations);

/// Within these, terms take an input for 0: the zero bands, but in filtered rows with known noise no wider than 4
/// standard deviations. Rows of a machine that creeps are set apart beside those at which it sticks, but it moves.
Eigen::VectorXd bands_of_errors(const Inputs& inputs);

}  // namespace llmt::discovery
