/// \file
/// A calibration as a document, which a terminal, a page and a notebook show.
#pragma once

#include "report/document/document.hpp"
#include "report/robot/calibration_run.hpp"

namespace llmt::report {

/// Verdict, errors, parameters and how well the poses determine them, in words and tables. Without the tables where the
/// calibration is implausible.
Document calibration_document(const CalibrationRun& run);

/// The first line of it: "table.csv: 120 positions of arm". `table`: how the table is called.
std::string subject_of(const CalibrationRun& run, const std::string& table);

}  // namespace llmt::report
