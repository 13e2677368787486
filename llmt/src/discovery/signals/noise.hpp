/// \file
/// Noise of a column of a log, from frequencies above its motion.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace llmt::discovery {

/// Standard deviation of white noise as strong as the noise of these samples is at the cutoff.
///
/// At frequencies f = 4, 8, ... times the cutoff and at half the sampling rate, the variance of white noise that is as
/// strong there is the median, over short windows, of mean squares of eighth differences of means. With a its value at
/// half the sampling rate and V(f) the others, noise that is stronger at low frequencies is a + t / f^2 (the tail of
/// AR(1) noise), so that
///
///     variance = a + max(0, min over f of (V(f) - a - 3 standard errors of V(f)) (f / cutoff)^2).
///
/// Jumps of a signal fall as 1 / f^2 too. They are in few of the short windows at high frequencies, hence the medians
/// and the minimum. `stretches` are of equally spaced samples, `step` in s apart; stretches too short for it do not
/// count. 0 if none is long enough.
double noise_at_cutoff(const std::vector<Eigen::VectorXd>& stretches, double cutoff, double step);

}  // namespace llmt::discovery
