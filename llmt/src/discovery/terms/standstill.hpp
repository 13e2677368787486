// Rows where the sign of an input is not known.
#pragma once

#include <string>
#include <vector>

#include "discovery/terms/row_split.hpp"

namespace llmt::discovery {

/// Rows set apart because |x| < limit of an input whose sign is not known there.
struct UnknownSign {
  std::string input;
  double limit = 0.0;
  Eigen::Index rows = 0;
  double roughness = 0.0;  ///< scatter there, in units of that of the other rows
};

/// Inputs that change sign, with known errors: the limit is 3 standard deviations of the error. A row is rough as its
/// deviation differs from what its neighbours in time say: fourth differences. Rows are set apart where those below the
/// limit are clearly rougher than the others (mean square 2.5 times as large), because the simulation or the machine
/// jumps with the sign. Marks these rows in `apart`.
std::vector<UnknownSign> rows_of_unknown_sign(const Rows& rows, const Inputs& inputs, const Eigen::MatrixXd& covariance,
                                              const Eigen::MatrixXd& deviations, std::vector<bool>& apart);

/// For rows in time: p zero bands, 0 for inputs that do not rest. An input rests if it changes sign, is smooth in
/// time, and stands at 0 more often than it passes: at least 20 rows lie within the band, and the outer half of the
/// band holds at least three times as many rows as an interval of that width where the input passes. Dry friction at
/// rest is whatever holds, so that rows within the band say nothing of it. They matter where the deviations (n x d)
/// jump: least squares of the next tenth of the rows on both sides on 1, x and sgn x gives sgn x more than 4 standard
/// errors. Else the band is 0. Bands of more than half of the rows are not looked at. Of a position, its speed and its
/// acceleration (`motions`) only the speed rests. Where several inputs jump, as axes that stop together, the surest is
/// taken first; the next is looked at on the rows that are left, with the signs of those taken as columns beside it.
Eigen::VectorXd zero_bands(const Inputs& inputs, const Eigen::MatrixXd& deviations);

/// Marks the rows at which an input is within its band.
std::vector<bool> rows_at_rest(const Inputs& inputs);

/// Within these, terms take an input for 0: the zero bands, but in filtered rows with known noise no wider than 4
/// standard deviations. Rows of a machine that creeps are set apart beside those at which it sticks, but it moves.
Eigen::VectorXd bands_of_errors(const Inputs& inputs);

std::vector<std::string> notes_on_rest(const Inputs& inputs);

/// The split without the rows set apart. A sample keeps those of its rows that are left, if half of them are.
RowSplit without_rows(const RowSplit& split, const std::vector<bool>& apart);

}  // namespace llmt::discovery
