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

/// The split without the rows set apart. A sample keeps those of its rows that are left, if half of them are.
RowSplit without_rows(const RowSplit& split, const std::vector<bool>& apart);

}  // namespace llmt::discovery
