/// \file
/// How far measured outputs lie from free runs of a model, as runs over held-out stretches tell.
///
///     const llmt::DynamicModel drive = llmt::load_dynamic("drive.json");
///     const llmt::Run run = llmt::simulate(drive, inputs, outputs.topRows(drive.memory()));
///     const llmt::Bounds bounds = llmt::run_bounds(drive, run, 0.9);  // bounds.lower, bounds.upper: rows x outputs
#pragma once

#include <Eigen/Core>

#include "llmt/abi.hpp"
#include "llmt/bounds.hpp"
#include "llmt/dynamic_model.hpp"
#include "llmt/simulator.hpp"

namespace llmt {

/// Half the width of the band of an output `rows` rows (1, 2, ...) after the last measured one: the smallest error that
/// is as large as ceil(level (n + 1)) of the n held-out ones there. Between the rows of two lists it follows a straight
/// line. Beyond the last list it stays, or, of an output that adds up its changes, goes on in proportion to the rows.
/// Throws std::invalid_argument if the model has no held-out errors, there is no such output, the level is not between
/// 0 and 1, or there are too few errors for it.
double half_width(const DynamicModel& model, Eigen::Index output, double rows, double level);

/// The band of a run, rows x outputs: the simulated output plus and minus half_width(), within the stops of the output.
/// The rows that the run began with have no width. NaN where the run has ended. Throws as half_width().
Bounds run_bounds(const DynamicModel& model, const Run& run, double level);

}  // namespace llmt
