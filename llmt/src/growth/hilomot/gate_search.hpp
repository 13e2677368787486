/// \file
/// Where the optimisation of a gate starts, and the best gate that it finds.
#pragma once

#include "growth/hilomot/oblique_split.hpp"

namespace llmt {

/// From the best of the first `axes` directions (columns, in the coordinates of GateProblem::z) and from all others;
/// those that are zero do not count. `evaluations` are those of all starts; an infinite loss: nothing is admissible.
GateFit best_gate(const GateProblem& problem, const Eigen::MatrixXd& directions, Eigen::Index axes, int max_threads);

/// The direction in which the residuals are most curved: principal Hessian direction (Li 1992).
Eigen::VectorXd most_curved(const GateProblem& problem);

}  // namespace llmt
