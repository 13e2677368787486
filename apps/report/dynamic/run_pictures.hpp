/// \file
/// Charts of runs of a model of a system that moves, and of the model itself.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/bounds.hpp"
#include "llmt/dynamic_analysis.hpp"
#include "llmt/series.hpp"
#include "report/document/document.hpp"

namespace llmt::report {

/// A run over the rows of a series, NaN where there is none. No band: matrices without rows.
struct DrawnRun {
  const DynamicModel& model;
  const Series& series;
  const Eigen::MatrixXd& outputs;
  Bounds band = {};
};

/// Measured and simulated values of an output over time, the first 3000 rows of the run.
Chart run_chart(const DrawnRun& run, Eigen::Index output, const std::string& caption);

/// The leaf that counts most at each row of the run, one chart a partition of the tree; none for other models.
std::vector<Chart> leaf_charts(const DrawnRun& run);

/// Spectrum, whiteness and correlation with the inputs of one output's errors.
std::vector<Chart> residual_charts(const ResidualTests& tests, const DynamicModel& model);

/// Step responses of all local models, one chart for each input and output, of nine at most.
std::vector<Chart> step_charts(const DynamicModel& model);

/// States of rest over each input that changes, one chart for each input and output, of nine at most.
std::vector<Chart> static_charts(const DynamicModel& model);

/// Half the width of the band over the rows since a run began.
Chart band_chart(const DynamicModel& model, Eigen::Index output);

}  // namespace llmt::report
