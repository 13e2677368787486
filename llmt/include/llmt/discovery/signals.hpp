/// \file
/// From a log of positions and torques to rows that a model of the motion can be compared with: one low pass without
/// delay for all signals, velocities and accelerations through the same filter, rows that are nearly independent.
///
///     const llmt::discovery::Signals table = llmt::discovery::signals(recorded, {.cutoff = 10.0});
///     const Eigen::MatrixXd friction = table.velocities.array().sign();
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/discovery/log.hpp"

namespace llmt::discovery {

struct SignalsOptions {
  double cutoff = 0.0;  ///< in Hz: the gain is 1/sqrt(2) there
  /// Speed up to which a position stands still: one value for all or one each. Empty: found from the noise and the
  /// filter.
  std::vector<double> standstill{};
  /// Samples from one row kept to the next. 0: rows are twelve times as dense as rows of independent noise, so that a
  /// simulation at these rows can be filtered alike, see Inputs::cutoff; or as dense, with `independent`.
  Eigen::Index every = 0;
  /// Rows whose noise is independent, without standstill and reversals: for a least squares fit of one's own.
  bool independent = false;
};

/// A part of the log without a gap.
struct Stretch {
  std::string run;
  Eigen::Index first = 0;  ///< row of the log
  Eigen::Index last = 0;   ///< row of the log, included
  Eigen::Index kept = 0;   ///< rows made of it; 0: shorter than the filter, or all standstill
};

/// What white noise of a column becomes in the filter.
struct ColumnNoise {
  double in_log = 0.0;           ///< standard deviation of white noise as strong as the noise is near the cutoff
  double in_table = 0.0;         ///< standard deviation of the filtered signal
  double of_velocity = 0.0;      ///< of its first derivative
  double of_acceleration = 0.0;  ///< of its second derivative
};

/// m rows, in the order of time.
struct Signals {
  Eigen::VectorXd time;            ///< m, in s
  Eigen::MatrixXd positions;       ///< m x p
  Eigen::MatrixXd velocities;      ///< m x p
  Eigen::MatrixXd accelerations;   ///< m x p
  Eigen::MatrixXd torques;         ///< m x k
  std::vector<Eigen::Index> rows;  ///< m: the row of the log at that time
  std::vector<Stretch> stretches;  ///< all of the log
  double step = 0.0;               ///< of the samples, in s
  double half_length = 0.0;        ///< of the filter, in s: cut at both ends of every stretch
  Eigen::Index every = 1;          ///< samples from one row kept to the next
  double correlation = 0.0;        ///< of white noise, filtered, between rows that follow each other
  std::vector<double> standstill;  ///< p: speed up to which a position stands still
  std::vector<bool> moves;         ///< p: false: never faster than that; leaves no row out
  double lobe = 0.0;               ///< in s: time to a reversal within which a row is left out; 0: not considered
  Eigen::Index ends_cut = 0;       ///< samples at the ends of stretches
  Eigen::Index standing = 0;       ///< rows that were left out because a position stands still or reverses
  bool dense = false;              ///< a simulation at these rows can be filtered as the torques were
  bool resampled = false;          ///< samples were not equally spaced, and were interpolated
  std::vector<ColumnNoise> position_noise;  ///< p
  std::vector<ColumnNoise> torque_noise;    ///< k; derivatives are 0
};

/// Filters and differentiates. With x = (2 pi f s)^2 / 2 the filter has the gain
///
///     H(f) = exp(-x) (1 + x + x^2/2 + x^3/6),      H(cutoff) = 1/sqrt(2),
///
/// a Gaussian of width s that is made flat at low frequencies by Hermite polynomials: its kernel is symmetric, so there
/// is no delay (Wand and Schucany, Gaussian-based kernels, Canadian Journal of Statistics 18, 1990). Velocities and
/// accelerations are convolutions with the first and second derivative of the same kernel: their gains are 2 pi f H and
/// (2 pi f)^2 H. Every relation that is linear with constant coefficients, as m ddq + d dq + k q = u, therefore holds
/// between the filtered columns as it did between the signals. The kernel ends at 7 s = 2.6 / cutoff.
///
/// Times: steps that differ are interpolated (cubic) at the median step, unless times that were rounded explain them.
/// A step of more than 2.5 median steps is a gap; a gap and a new run end a stretch, and no filter reaches across.
///
/// Dense rows hold reversals and standstill. A model that jumps there, as dry friction does, is to be compared with the
/// torques after it went through the same filter, as find_missing() does with Inputs::cutoff.
///
/// Standstill, with `independent` or where speeds are given: a row is left out where a speed is at most 4 standard
/// deviations of its noise, so that its sign is not known, or at most acceleration x 0.43 / cutoff, so that it reverses
/// within the main lobe of the filter, which rounds whatever jumps there. Positions that never move (never faster than
/// 5 times that speed) leave nothing out.
///
/// Throws LogError for wrong shapes, values that are not finite, a cutoff that is not above 0 or above a quarter of the
/// sampling rate, times that do not increase within a run, a run that is there twice, more than a tenth of the steps
/// longer or shorter than the median step by half, and where no row is left.
Signals signals(const Log& log, const SignalsOptions& options);

}  // namespace llmt::discovery
