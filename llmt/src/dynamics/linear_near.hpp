/// \file
/// The linear model near a row of regressors, where outputs may stand at their stops.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "llmt/dynamic_analysis.hpp"

namespace llmt {

/// As dynamics_at(). `stops`: one an output, whether it stands at a stop; then of_outputs tells how what pushes it
/// against the stop goes on.
LocalDynamics linear_near(const DynamicModel& model, const Eigen::VectorXd& regressors, const std::vector<bool>& stops,
                          std::string where);

}  // namespace llmt
