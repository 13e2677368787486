/// \file
/// The page of `llmt-robot calibrate`.
#pragma once

#include "report/document/document.hpp"
#include "report/robot/calibration_run.hpp"

namespace llmt::report {

/// calibration_document() with pictures.
Document calibration_page(const CalibrationRun& run);

}  // namespace llmt::report
