/// \file
/// Polynomials by their values at Chebyshev points.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace llmt {

/// The degree + 1 zeros of the Chebyshev polynomial T_(degree + 1), moved to 0 ... 1.
std::vector<double> chebyshev_points(int degree);

/// The coefficients a of p(x) = sum_k a_k T_k(2 x - 1), from the values of p at chebyshev_points(values.size() - 1).
Eigen::VectorXd chebyshev_coefficients(const Eigen::VectorXd& values);

/// Where within 0 ... 1 the polynomial of these coefficients has the value `level`, ascending: eigenvalues of the
/// colleague matrix (Good 1961). Zeros that touch the level without crossing it may be missing or stand twice; a
/// constant has none.
std::vector<double> positions_of_level(Eigen::VectorXd coefficients, double level);

}  // namespace llmt
