// How far deviations that follow each other in time are alike.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace llmt::discovery {

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
