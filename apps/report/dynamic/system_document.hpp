/// \file
/// Pictures of a model of a system that moves, and of its runs.
#pragma once

#include "report/document/document.hpp"
#include "report/dynamic/dynamic_report.hpp"

namespace llmt::report {

/// Runs over held-out stretches, errors, local models, states of rest, and what the terminal says.
Document dynamic_document(const DynamicRun& run);

/// The run over time and, where outputs were measured, its errors.
Document simulated_document(const SimulatedRecords& simulated);

}  // namespace llmt::report
