/// \file
/// What people read of the band about runs, of local models and of states of rest.
#pragma once

#include <string>

#include "llmt/dynamic_analysis.hpp"
#include "llmt/static_curve.hpp"
#include "report/text/json.hpp"

namespace llmt::report {

/// The band that is printed and drawn where none is asked for.
inline constexpr double band_level = 0.9;

/// A line for each output: half the width of the band of 90 % over the rows since a run began. Empty without a band.
std::string band_text(const DynamicModel& model);
Json band_json(const DynamicModel& model);

/// A row for each local model: poles, steady gains, settling time.
std::string local_table(const DynamicModel& model, std::size_t width);
Json local_json(const DynamicModel& model);

/// Outputs at rest at five values of each input, of three inputs at most, or why there are none.
std::string static_text(const DynamicModel& model, std::size_t width);
Json static_json(const DynamicModel& model);

/// Rows that show the step response of all of the local models.
Eigen::Index step_rows(const std::vector<LocalDynamics>& all);

/// Whether an output adds up its changes, so that there are no states of rest.
bool has_sums(const DynamicModel& model);

}  // namespace llmt::report
