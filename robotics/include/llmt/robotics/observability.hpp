/// \file
/// How well poses show the parameters of a calibration: the observability indices of the literature.
///
///     const Eigen::VectorXd singular_values = calibrate(robot, measured).result.singular_values;
///     const Observability seen = observability(singular_values, measured.count());
#pragma once

#include <Eigen/Core>

#include "llmt/abi.hpp"

namespace llmt::robotics {

/// Indices of the identification Jacobian with singular values s1 >= ... >= sL of m poses. Rows are measured
/// coordinates over their standard deviation, columns the identifiable parameters times their scales. All five are the
/// better the larger they are, and comparable only with the same columns and scales.
struct Observability {
  double o1 = 0.0;              ///< (s1 ... sL)^(1/L) / sqrt(m): Borm & Menq 1991; D-optimal poses maximise it
  double o2 = 0.0;              ///< sL / s1: Driels & Pathre 1990
  double o3 = 0.0;              ///< sL: Nahvi, Hollerbach & Hayward 1994; E-optimal poses maximise it
  double o4 = 0.0;              ///< sL^2 / s1: Nahvi & Hollerbach 1996
  double o5 = 0.0;              ///< 1 / (1/s1 + ... + 1/sL): Sun & Hollerbach 2008
  double condition = 0.0;       ///< s1 / sL; infinite where sL is 0
  Eigen::Index parameters = 0;  ///< L
};

/// The indices of those singular values, in any order. Throws std::invalid_argument if there are none, one is negative
/// or not finite, or poses < 1.
Observability observability(const Eigen::VectorXd& singular_values, Eigen::Index poses);

}  // namespace llmt::robotics
