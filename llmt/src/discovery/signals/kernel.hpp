/// \file
/// The low pass of signals(), and its derivatives, as weights of equally spaced samples.
#pragma once

#include <Eigen/Core>

namespace llmt::discovery {

struct Kernel {
  Eigen::Index half = 0;     ///< samples on either side of the middle one
  Eigen::MatrixX3d weights;  ///< (2 half + 1) x 3: of the signal, its first and its second derivative
  double lobe = 0.0;         ///< in s: where the weights of the signal first change sign
};

/// Width s of the Gaussian, in s.
double width_of(double cutoff);

/// Samples on either side of the middle one.
Eigen::Index half_length(double cutoff, double step);

/// Samples after which the noise of rows counts as independent: the sum over all lags of the squared correlation
/// of white noise that was filtered (so that n rows of length T have the degrees of freedom of the filtered record).
Eigen::Index independent_step(double cutoff, double step);

Kernel kernel_of(double cutoff, double step);

/// The kernel up to 5 widths, for rows `step` apart; 2 h + 1 weights that add up to 1.
Eigen::VectorXd low_pass(double cutoff, double step);

/// Three weights of sum 1, of the means of what is `stride`, 2 stride and 3 stride samples before and after one. Taken
/// of a speed, or of an acceleration, of a position with white noise, the error of this mean is uncorrelated with the
/// error of the sample itself after it has been through the low pass once more.
Eigen::Vector3d uncorrelated_neighbours(double cutoff, double step, Eigen::Index stride);

/// Correlation of filtered white noise at a distance of `lag` samples.
double correlation_at(const Kernel& kernel, Eigen::Index lag);

}  // namespace llmt::discovery
