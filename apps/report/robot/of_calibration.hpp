/// \file
/// The report of `llmt-robot calibrate`.
#pragma once

#include <string>
#include <vector>

#include "llmt/robotics/calibration_report.hpp"
#include "report/document/document.hpp"

namespace llmt::report {

struct Calibrated {
  std::string robot;  ///< the file
  std::string data;   ///< the file
  const robotics::Robot& nominal;
  const robotics::Measurements& measurements;
  const robotics::CalibrationReport& report;
  const robotics::ReportOptions& options;
  const std::vector<std::string>& suspicions;  ///< what looks like a mistake
};

Document calibration_report(const Calibrated& calibrated);

}  // namespace llmt::report
