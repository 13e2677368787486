/// \file
/// Estimation of a dynamic model's parameters on simulated records.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "dynamics/windows.hpp"

namespace llmt {

struct OutputErrorOptions {
  int iterations = 30;              ///< at most
  double ridge = 0.0;               ///< see estimate_on_runs()
  double enough = 1e-5;             ///< relative decrease of the cost below which the search ends
  Eigen::VectorXd step_scale = {};  ///< units of the parameters of each output; empty: those of the errors
};

struct OutputErrorResult {
  DynamicParts parts;
  double cost = 0.0;  ///< sum of squares in units of the outputs' deviations; infinity: no run stayed in the bounds
  int iterations = 0;
};

/// Minimises, by Levenberg and Marquardt's method (Marquardt 1963), the sum of squares
///   sum over windows, rows and outputs of ((measured - simulated) / scale)^2 + ridge n |theta_b / step_scale|^2
/// where theta_b are the parameters beyond a linear model and n the judged values. Partition, validities and guards
/// stay as they are. A step is taken only if it lowers the sum.
OutputErrorResult estimate_on_runs(const DynamicParts& start, const Series& series, const std::vector<Window>& windows,
                                   const Eigen::VectorXd& scale, const OutputErrorOptions& options = {});

}  // namespace llmt
