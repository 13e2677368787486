/// \file
/// What people read of a model of a system that moves, and of its runs.
#pragma once

#include <string>
#include <vector>

#include "llmt/bounds.hpp"
#include "llmt/dynamic_analysis.hpp"
#include "llmt/fit_dynamic.hpp"
#include "llmt/simulator.hpp"
#include "report/text/json.hpp"

namespace llmt::report {

/// A fit and where it came from.
struct DynamicRun {
  std::string data;    ///< name of the table
  std::string output;  ///< file of the model; empty: none
  const Series& series;
  const DynamicFit& fit;
  Eigen::Index horizon = 0;
};

std::string dynamic_text(const DynamicRun& run, std::size_t width);
Json dynamic_json(const DynamicRun& run);

/// Runs of a model over the records of a table.
struct SimulatedRecords {
  std::string data;
  const DynamicModel& model;
  const Series& series;
  Eigen::MatrixXd outputs;          ///< rows x outputs
  std::vector<Run> runs;            ///< one a record
  std::vector<Eigen::Index> lines;  ///< of the rows, in the file
  bool has_measured = false;        ///< the table has the outputs too
  Eigen::Index initial = 0;         ///< measured rows before each run
  double level = 0.0;               ///< of the band; 0: none is asked for
  Bounds band = {};                 ///< rows x outputs
};

/// Errors beside the measured outputs where there are any, and where runs left the data or the bounds.
std::string simulated_text(const SimulatedRecords& simulated);
Json simulated_json(const SimulatedRecords& simulated);

/// The outputs as a table: NAME_simulated for each output, and NAME_low and NAME_high if there is a band; rows as in
/// the file; empty where there is no run.
std::string simulated_table(const SimulatedRecords& simulated);

}  // namespace llmt::report
