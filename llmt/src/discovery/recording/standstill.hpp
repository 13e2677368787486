// Bands around zero within which a machine rests.
#pragma once

#include <Eigen/Core>

#include "discovery/recording/recording.hpp"

namespace llmt::discovery {

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
