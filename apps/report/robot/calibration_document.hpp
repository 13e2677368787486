/// \file
/// A calibration as a document, which a terminal, a page and a notebook show.
#pragma once

#include "report/document/document.hpp"
#include "report/robot/calibration_run.hpp"

namespace llmt::report {

/// Verdict, errors, parameters and how well the poses determine them, in words and tables. Without the tables where the
/// calibration is implausible.
Document calibration_document(const CalibrationRun& run);

}  // namespace llmt::report
