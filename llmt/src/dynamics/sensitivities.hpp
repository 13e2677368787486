/// \file
/// Runs with the derivatives of the simulated outputs by all parameters.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "dynamics/windows.hpp"

namespace llmt {

/// The derivatives of a run: d y(t) / d theta = dg / d theta + sum_j dg / dx_j d x_j(t) / d theta, where the second
/// part runs through the earlier simulated outputs (forward sensitivities). Calls visit(row, y, sensitivities), where
/// `sensitivities` is parameters x outputs, for every simulated row. Returns false, after fewer rows, where an output
/// leaves the bounds.
template <class Visit>
bool run_with_sensitivities(const DynamicParts& parts, const Series& series, const Window& window,
                            const Eigen::VectorXd& lower, const Eigen::VectorXd& upper, const Visit& visit);

/// The sum of squares of simulated minus measured outputs, each in units of `scale`, over windows, and its Gauss-Newton
/// equations.
struct RunEquations {
  double cost = 0.0;         ///< infinity if a run left the bounds
  double rows = 0.0;         ///< judged values
  Eigen::MatrixXd normal;    ///< sum of sensitivities times their transposes; lower triangle and upper
  Eigen::VectorXd gradient;  ///< sum of sensitivities times (measured - simulated)
};
RunEquations run_equations(const DynamicParts& parts, const Series& series, const std::vector<Window>& windows,
                           const Eigen::VectorXd& scale);

/// The sum of squares alone.
double run_cost(const DynamicParts& parts, const Series& series, const std::vector<Window>& windows,
                const Eigen::VectorXd& scale);

}  // namespace llmt
