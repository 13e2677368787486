// What --input-noise says.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace llmt::apps {

/// Inputs::noise from "x=0.1", "y=2" or "auto"; empty for none. Throws std::invalid_argument naming the entry.
Eigen::VectorXd errors_of_inputs(const std::vector<std::string>& given, const std::vector<std::string>& inputs);

}  // namespace llmt::apps
