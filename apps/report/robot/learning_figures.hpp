/// \file
/// Whether more poses would lower the error, as a chart and as a table.
#pragma once

#include <vector>

#include "llmt/robotics/calibration_quality.hpp"
#include "report/document/document.hpp"

namespace llmt::report {

Chart learning_chart(const std::vector<robotics::LearningPoint>& curve);
Grid learning_grid(const std::vector<robotics::LearningPoint>& curve);

}  // namespace llmt::report
