/// \file
/// Where the optimisation of a gate starts, and the best gate that it finds.
#pragma once

#include "growth/hilomot/oblique_split.hpp"

namespace llmt {

/// The best gate that the optimisation finds from several starts: the best two of the first `axes` directions (columns,
/// in the coordinates of GateProblem::z) and all other directions that are not zero. `evaluations` is the sum over all
/// starts. The loss is infinite if no gate is admissible.
GateFit best_gate(const GateProblem& problem, const Eigen::MatrixXd& directions, Eigen::Index axes, int max_threads);

/// The direction in which the residuals are most curved: principal Hessian direction (Li 1992).
Eigen::VectorXd most_curved(const GateProblem& problem);

}  // namespace llmt
