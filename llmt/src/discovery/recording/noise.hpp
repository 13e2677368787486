// The noise of signals that follow each other in time: how large it is, and how far it is alike in neighbours.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/discovery/model_term.hpp"

namespace llmt::discovery {

/// Rows in the order of time.
using Piece = std::vector<Eigen::Index>;

/// A signal whose noise is a larger share of its variance is not smooth: its neighbours say nothing of it.
inline constexpr double largest_noise_of_smooth = 0.4;

/// Files have a limited number of digits: what differs by less than this share of its range is the same.
inline constexpr double digits_of_a_file = 1e-6;

/// The variance of a column and of its noise.
struct Signal {
  Eigen::Index column = 0;
  double variance = 0.0;
  double noise = 0.0;

  bool is_smooth() const { return noise <= largest_noise_of_smooth * variance; }
};

/// Variance of the noise of equally spaced values of a smooth signal, from third differences: var(D^3 e) = 20 var(e).
/// NaN for fewer than 4 values.
double noise_variance(const Eigen::VectorXd& values);

/// Columns that vary, with the noise in pieces of rows.
std::vector<Signal> signals_of(const std::vector<Piece>& pieces, const Eigen::MatrixXd& values);

/// The places in time by which no smooth signal changes much: the longest lag l at which
/// mean (v_(i+l) - v_i)^2 / 2, without the noise, is at most 18 % of the variance of every smooth column (for a sine of
/// period P: l = 0.1 P); at least 2.
Eigen::Index smooth_lag(const Rows& rows, const Eigen::MatrixXd& signals);

/// Covariance of the errors of inputs that are smooth in time, from divided differences of order 8 (of 6 or 4 where
/// fewer than 50 rows have such), which leave next to nothing of the motion. Rows where a signal jumps (a difference
/// beyond 5 robust standard deviations of any column) do not count. Zero for columns that are constant or not smooth.
Eigen::MatrixXd noise_in_time(const Rows& rows, const Inputs& inputs);

/// Covariance of the errors of the inputs: as Inputs::noise says, estimated by noise_in_time() where it says nothing.
Eigen::MatrixXd covariance_of_errors(const Rows& rows, const Inputs& inputs);

/// Autocorrelation of values in stretches: rho_k = sum_i v_i v_(i+k) / sum_i v_i^2 (pairs within a stretch only, scaled
/// to the number of pairs), for k = 1, 2, ... up to the first that is not significant (1.65 / sqrt(pairs)). `used`: a
/// flag for each value; values without it are left out.
std::vector<double> autocorrelation(const Eigen::VectorXd& values, const std::vector<Eigen::Index>& stretches,
                                    const std::vector<bool>& used);

/// The share of the values that count as independent when a mean is formed: 1 / (1 + 2 sum_k rho_k)
/// (Bartlett 1935; Geyer 1992 for where to stop), at most 1.
double independent_share(const std::vector<double>& correlation);

/// The factor on the variance of an estimate sum_i z_i v_i that the correlation of v makes: 1 + 2 sum_k rho_k r_k, r_k
/// that of the influences z at the same lags; at least 1.
double variance_inflation(const std::vector<double>& correlation, const Eigen::VectorXd& influences,
                          const std::vector<Eigen::Index>& stretches);

}  // namespace llmt::discovery
